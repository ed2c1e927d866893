// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "kernels/channel_norm.h"
#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// gamma or beta of a normalisation, [1,1,1,channels], all `start`; without weight decay.
inline Parameter channel_parameter(std::string name, int channels, float start) {
  Parameter parameter;
  parameter.name = std::move(name);
  parameter.value = Tensor({1, 1, 1, channels});
  parameter.decay = false;
  parameter.value.fill(start);
  return parameter;
}

/// y = (x - mean) * inv_std * gamma + beta.
inline ChannelAffine affine_of(const ChannelStatistics& statistics, const Tensor& gamma,
                               const Tensor& beta) {
  ChannelAffine affine;
  for (int c = 0; c < gamma.shape().c; ++c) {
    const double scale = gamma.data()[c] * statistics.inv_std[c];
    affine.scale.push_back(scale);
    affine.shift.push_back(beta.data()[c] - statistics.mean[c] * scale);
  }
  return affine;
}

}  // namespace sdmt::nn
