// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "kernels/channel_norm.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

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
