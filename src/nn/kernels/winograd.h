// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// 3x3 convolution of stride 1 and padding 1 by Winograd's minimal filtering F(4x4,3x3) (Lavin &
/// Gray, "Fast Algorithms for Convolutional Neural Networks", CVPR 2016): a 6x6 tile of the input
/// and the weights are transformed, multiplied channel by channel at each of the 36 positions,
/// which makes 36 matrix products over all tiles, and transformed back to a 4x4 tile of the output;
/// 36 multiplications stand for 144. The interpolation points are 0, +-sqrt(1/2), +-sqrt(2) and
/// infinity: their largest rounding error is a quarter of that of the usual 0, +-1, +-2, infinity,
/// and less than twice that of the sum itself (docs/performance.md).

/// Weights in the transformed domain, in the order in which this machine's matrix kernel reads
/// them.
class WinogradWeights {
 public:
  /// From weights [out,3,3,in].
  void set(const Tensor& weight);
  /// For the gradient with respect to the input: weights turned by 180 degrees, in and out swapped.
  void set_transposed(const Tensor& weight);

  void clear() { in_ = out_ = 0; }
  bool empty() const { return in_ == 0; }
  int in_channels() const { return in_; }
  int out_channels() const { return out_; }
  const float* data() const { return values_.data(); }
  std::size_t size() const { return values_.size(); }

 private:
  int in_ = 0;
  int out_ = 0;
  Tensor values_;  // [36][panel of columns][in][column]
};

/// What happens to the result before it is stored.
struct WinogradEpilogue {
  const float* bias = nullptr;  ///< out_channels values
  bool relu = false;
  bool max_pool = false;         ///< 2x2, stride 2, an odd last row or column dropped
  const Tensor* mask = nullptr;  ///< of the result's shape: results where it is not > 0 become 0
};

/// y [n,h,w,out] or, with max_pool, [n,h/2,w/2,out]; y is resized. Each value depends on its own
/// image alone: the same for any batch and number of threads.
void winograd_convolution(const Tensor& x, const WinogradWeights& weights,
                          const WinogradEpilogue& epilogue, Tensor& y);

/// Adds dL/dweight [out,3,3,in] to `weight_gradient`, and dL/dbias to `bias_gradient` unless it is
/// null, for the convolution of x [n,h,w,in] whose result has the gradient dy [n,h,w,out].
void winograd_weight_gradient(const Tensor& x, const Tensor& dy, float* weight_gradient,
                              float* bias_gradient);

}  // namespace sdmt::nn
