// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/channel_norm.h"
#include "sdmt/nn/batch_shards.h"
#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// What normalisations sum over a batch that is cut into shards, of which other processes may have
/// some.

/// Rows of channels of n images.
inline std::int64_t rows_of(const Shape& shape) {
  return std::int64_t{shape.n} * shape.h * shape.w;
}

/// Moments of the whole batch; x holds the images that are here.
ChannelMoments moments_of_batch(const Tensor& x, const BatchShards& shards);

/// Sums of dy of the whole batch, as channel_gradient_sums().
ChannelGradientSums gradient_sums_of_batch(const Tensor& x, const Tensor& dy,
                                           const ChannelStatistics& statistics,
                                           const ChannelAffine& affine, const BatchShards& shards);

ChannelGradientSums zero_sums(int channels);
void add_sums(const ChannelGradientSums& from, ChannelGradientSums& to);
/// Of all shards, given those of the shards that are here, at their places.
ChannelGradientSums sum_of_shards(std::vector<ChannelGradientSums> parts,
                                  const BatchShards& shards);

/// Adds the sums to the parameter's gradient unless it is frozen.
void add_to_gradient(const ChannelValues& sums, Parameter& parameter);

}  // namespace sdmt::nn
