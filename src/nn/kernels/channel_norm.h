// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// The arithmetic of batch normalisation over the rows of a tensor seen as a matrix [n*h*w, c].
/// Everything is done in double and rounded after every operation, and sums are taken over parts of
/// fixed length that are added up in order: the same bits on every instruction set and any number
/// of threads.

/// A value for every channel.
using ChannelValues = std::vector<double>;

struct ChannelMoments {
  ChannelValues mean;
  ChannelValues squares;  ///< sum of the squared distances from the mean
};

/// Reads x once.
ChannelMoments channel_moments(const Tensor& x);

/// What makes y = x * scale + shift of x, and with relu max(y, 0).
struct ChannelAffine {
  ChannelValues scale;
  ChannelValues shift;
  bool relu = false;
};

/// y gets x's shape.
void channel_affine(const Tensor& x, const ChannelAffine& affine, Tensor& y);

/// Of the batch, as the forward pass found them.
struct ChannelStatistics {
  ChannelValues mean;
  ChannelValues inv_std;
};

struct ChannelGradientSums {
  ChannelValues dy;       ///< sum of dy
  ChannelValues dy_by_x;  ///< sum of dy times the normalised x
};

/// The sums over all rows that the gradient needs. Where affine.relu is set, dy counts only where
/// the result of `affine` is positive.
ChannelGradientSums channel_gradient_sums(const Tensor& x, const Tensor& dy,
                                          const ChannelStatistics& statistics,
                                          const ChannelAffine& affine);

/// dL/dx for y = (x - mean) * inv_std * weight + bias, whose mean and inv_std depend on x too:
/// their share removes the mean of dy and its part along x. dx gets x's shape; it may be dy.
void channel_input_gradient(const Tensor& x, const Tensor& dy, const ChannelStatistics& statistics,
                            const ChannelAffine& affine, const ChannelGradientSums& sums,
                            Tensor& dx);

}  // namespace sdmt::nn
