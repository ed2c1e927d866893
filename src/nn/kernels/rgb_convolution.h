// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// 3x3 convolution of stride 1 and padding 1 over images of three channels, the first layer of a
/// network: the matrix kernel reads the 9 values of a window's row where they lie in the image.

/// Whether the kernels below are made for so many output channels.
bool has_rgb_convolution(int out_channels);

/// y [n,h,w,out] of x [n,h,w,3]; weight [out,3,3,3]; bias of out values or null.
void rgb_convolution(const Tensor& x, const Tensor& weight, const float* bias, bool relu,
                     Tensor& y);

/// Adds dL/dweight [out,3,3,3] to `weight_gradient` and dL/dbias to `bias_gradient` unless it is
/// null.
void rgb_weight_gradient(const Tensor& x, const Tensor& dy, float* weight_gradient,
                         float* bias_gradient);

}  // namespace sdmt::nn
