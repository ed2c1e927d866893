// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// 3x3 convolution of stride 1 or 2 and padding 1 over images of three channels, the first layer of
/// a network: the matrix kernel reads the 9 values of a window's row where they lie in the image.

/// Whether the kernels below are made for so many output channels and this stride.
bool has_rgb_convolution(int out_channels, int stride);

struct RgbWeights {
  const Tensor& weight;         ///< [out,3,3,3]
  const float* bias = nullptr;  ///< out values or null
  int stride = 1;               ///< 1 or 2
};

/// y [n,ceil(h/stride),ceil(w/stride),out] of x [n,h,w,3].
void rgb_convolution(const Tensor& x, const RgbWeights& weights, bool relu, Tensor& y);

/// The same convolution made a few rows at a time, for a layer that reads them while they are in
/// the caches. What it is made of must outlive it, in the thread that made it.
class RgbRows {
 public:
  RgbRows(const Tensor& x, const RgbWeights& weights, bool relu);

  /// Of the result.
  Shape shape() const;
  /// Rows [top, top + rows) of an image's result, to `to` [rows,w,out]. In any thread.
  void compute(int image, int top, int rows, float* to) const;

 private:
  const Tensor& x_;
  RgbWeights weights_;
  const float* packed_;  // scratch memory of the thread
  bool relu_;
};

/// Sets `weight_gradient` to dL/dweight [out,3,3,3] and `bias_gradient`, unless it is null, to
/// dL/dbias, or adds them, each value by one addition.
void rgb_weight_gradient(const Tensor& x, const Tensor& dy, int stride, bool add,
                         float* weight_gradient, float* bias_gradient);

}  // namespace sdmt::nn
