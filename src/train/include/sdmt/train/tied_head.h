// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sdmt/nn/sequential.h"
#include "sdmt/reid/embedding_network.h"

namespace sdmt::train {

/// Blocks over which the first fully connected layer (FC1) is tied while it is trained.
///
/// The paper's FC1 reads the flattened 32 x 16 x 256 map: 16.8 million weights, which a few
/// thousand people cannot determine. Tied, all positions of a block of the map share their weights:
/// FC1 then reads the means of rows x columns blocks (8 x 2: 4,096 values), is 32 times cheaper and
/// generalises better. It is the same layer with fewer degrees of freedom: expanding the weights,
/// W[o, y, x, c] = Wp[o, block of (y, x), c] / positions in a block, gives the paper's layer.
struct BlockGrid {
  int rows = 8;     ///< divides the height of the map
  int columns = 2;  ///< divides its width

  bool operator==(const BlockGrid&) const = default;
};

/// The head of `network` with FC1, its first layer, tied: "blocks", then its layers. Weights
/// and statistics are copies; a tied weight is the sum over its block, so that an FC1 that was tied
/// before comes back as it was, and He initialisation stays He initialisation. Throws
/// std::invalid_argument when the blocks do not fill the map.
std::unique_ptr<nn::Sequential> make_tied_head(reid::EmbeddingNetwork& network, BlockGrid grid);

/// Writes such a head into `network`, FC1 expanded.
void store_tied_head(nn::Sequential& tied, BlockGrid grid, reid::EmbeddingNetwork& network);

}  // namespace sdmt::train
