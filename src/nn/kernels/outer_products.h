// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/nn/batch_shards.h"

namespace sdmt::nn {

/// The gradient of a matrix of weights [out,in]: the sums over images of the products of a row of
/// dy [n,out] and a row of x [n,in], both dense, with a row for each image of `shards` that is
/// here. That of each of their shard_nodes(), shard by shard along the tree, is added to one of
/// `targets` [out,in].
void add_outer_products(const BatchShards& shards, std::int64_t out, std::int64_t in,
                        const float* dy, const float* x, const std::vector<float*>& targets);

}  // namespace sdmt::nn
