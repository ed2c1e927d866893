// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "kernels/convolution_epilogue.h"
#include "kernels/winograd_geometry.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

class RgbRows;

/// 3x3 convolution of stride 1 and padding 1 by Winograd's minimal filtering F(h x w,3x3) (Lavin &
/// Gray, "Fast Algorithms for Convolutional Neural Networks", CVPR 2016): an (h+2) x (w+2) tile of
/// the input and the weights are transformed, multiplied channel by channel at each of the
/// positions, which makes as many matrix products over all tiles, and transformed back to an h x w
/// tile of the output. For 4x4, 36 multiplications stand for 144; for 8x8, 100 for 576; for 2x4, 24
/// for 72. The interpolation points (winograd_points.h) are chosen for their rounding error: with
/// 256 channels its root mean square is 7e-7 of the largest output for 4x4 and 8e-6 for 8x8, where
/// the sum itself has 2e-7 (docs/performance.md).

/// Weights in the transformed domain, in the order in which this machine's matrix kernel reads
/// them.
class WinogradWeights {
 public:
  /// From weights [out,3,3,in], for tiles of 2x4, 4x4 or 8x8.
  void set(const Tensor& weight, WinogradTileSize tile);
  /// For the gradient with respect to the input: weights turned by 180 degrees, in and out swapped;
  /// tiles of 4x4.
  void set_transposed(const Tensor& weight);

  void clear() { in_ = out_ = 0; }
  bool empty() const { return in_ == 0; }
  WinogradTileSize tile() const { return tile_; }
  int in_channels() const { return in_; }
  int out_channels() const { return out_; }
  const float* data() const { return values_.data(); }
  std::size_t size() const { return values_.size(); }

 private:
  int in_ = 0;
  int out_ = 0;
  WinogradTileSize tile_;
  Tensor values_;  // [position][panel of columns][in][column]
};

/// The tile with which an image of h rows and w columns takes the least time: large ones save
/// multiplications, small ones have fewer weights to be read. 4x4 on instruction sets that round
/// between multiplication and addition: 8x8 would double its error there.
WinogradTileSize fastest_winograd_tile(int h, int w);

/// y [n,h,w,out] or, with max_pool, [n,h/2,w/2,out]; y is resized. Each value depends on its own
/// image alone: the same for any batch and number of threads.
void winograd_convolution(const Tensor& x, const WinogradWeights& weights,
                          const ConvolutionEpilogue& epilogue, Tensor& y);

/// The same for the result of another convolution, made when it is needed: never whole.
void winograd_convolution(const RgbRows& x, const WinogradWeights& weights,
                          const ConvolutionEpilogue& epilogue, Tensor& y);

/// Sets `taps` to dL/dweight as [9,in,out] and `bias_gradient`, unless it is null, to dL/dbias, or
/// adds them, each value by one addition, for the convolution of x [n,h,w,in] whose result has the
/// gradient dy [n,h,w,out].
void winograd_weight_gradient(const Tensor& x, const Tensor& dy, bool add, float* taps,
                              float* bias_gradient);
/// Adds such taps to the gradient of a weight of that shape, [out,3,3,in].
void add_winograd_taps(const float* taps, Shape weight, float* weight_gradient);

}  // namespace sdmt::nn
