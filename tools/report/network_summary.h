// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sdmt/reid/embedding_network.h"

namespace sdmt::tools {

/// One layer as `inspect` and `bench` show it.
struct LayerSummary {
  std::string name;
  std::string type;
  nn::Shape output;             ///< for one picture
  std::int64_t parameters = 0;  ///< learnt values
  double gflop = 0;  ///< for one picture, a multiply-add counted as two, convolutions directly
};

/// Trunk, then head.
std::vector<LayerSummary> summarize(reid::EmbeddingNetwork& network);

/// Sum over the layers: 3.08 for vgg16 at 128 x 64.
double total_gflop(reid::EmbeddingNetwork& network);

}  // namespace sdmt::tools
