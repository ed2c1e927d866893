// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// The arithmetic of batch normalisation over the rows of a tensor seen as a matrix [n*h*w, c].
/// Everything is done in double and rounded after every operation, and sums are taken over groups
/// of rows, in parts of fixed length that are added up in order: the same bits on every instruction
/// set and any number of threads.

/// Groups of rows that follow each other: group i is rows [bounds[i], bounds[i + 1]); none is also
/// a group.
using RowBounds = std::vector<std::int64_t>;

/// A value for every channel.
using ChannelValues = std::vector<double>;

struct ChannelMoments {
  ChannelValues mean;
  ChannelValues squares;  ///< sum of the squared distances from the mean
};

/// Of each group; of no rows, zeros. Reads x once.
std::vector<ChannelMoments> channel_moments(const Tensor& x, const RowBounds& groups);
/// Adds those of other rows: `count` of them to `before`.
void merge_moments(double before, double count, double other_mean, double other_squares,
                   double& mean, double& squares);

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

/// The sums that the gradient needs over the rows of each group. Where affine.relu is set, dy
/// counts only where the result of `affine` is positive.
std::vector<ChannelGradientSums> channel_gradient_sums(const Tensor& x, const Tensor& dy,
                                                       const ChannelStatistics& statistics,
                                                       const ChannelAffine& affine,
                                                       const RowBounds& groups);

/// dL/dx for y = (x - mean) * inv_std * weight + bias, whose mean and inv_std depend on x too:
/// their share removes the mean of dy and its part along x. `sums` are over the `rows` that the
/// statistics are of. dx gets x's shape; it may be dy.
void channel_input_gradient(const Tensor& x, const Tensor& dy, const ChannelStatistics& statistics,
                            const ChannelAffine& affine, const ChannelGradientSums& sums,
                            double rows, Tensor& dx);

}  // namespace sdmt::nn
