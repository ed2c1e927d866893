// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <mutex>
#include <span>

#include "kernels/convolution_epilogue.h"
#include "kernels/winograd.h"
#include "sdmt/nn/conv2d.h"

namespace sdmt::nn {

/// The arithmetic of a Conv2d: which kernel computes what, and the transformed copies of the
/// weights that the kernels read.
///
/// 3x3 convolutions of stride 1 and padding 1 run by Winograd's minimal filtering, those of three
/// channels directly, all others by a matrix product. Training takes tiles of 4x4, inference
/// those of fastest_winograd_tile(). What is const may run in several threads at once.
class Convolution {
 public:
  /// The tensors must outlive it. `bias` is empty when there is none.
  Convolution(const Conv2dOptions& options, const Tensor& weight, const Tensor& bias);

  /// Throws as Conv2d::output_shape().
  Shape output_shape(Shape in) const;

  /// The convolution with its bias, then what `epilogue` has besides. Values are those of the
  /// separate layers.
  void forward(const Tensor& x, ConvolutionEpilogue epilogue, Mode mode, Tensor& y) const;
  /// Whether forward_after() is made for this convolution on that one.
  bool can_follow(const Convolution& first) const;
  /// forward() in inference on the result of `first` with a ReLU, which is made where it is needed
  /// and never stored whole.
  void forward_after(const Convolution& first, const Tensor& x, ConvolutionEpilogue epilogue,
                     Tensor& y) const;

  /// Sets weight and bias to dL/dweight and dL/dbias or adds them, each value by one addition; each
  /// may be null. The values of dL/dweight are in an order of the kernel's own.
  void parameter_sums(const Tensor& x, const Tensor& dy, bool add, float* weight, float* bias);
  /// Adds such values, of the weight or of the bias, to the gradient, which is in the tensor's
  /// order.
  void add_gradient(bool of_weight, std::span<const float> sums, float* gradient) const;
  /// Sets dx to dL/dx; where `mask` is given, of x's shape, only where it is positive.
  void input_gradient(const Tensor& x, const Tensor& dy, const Tensor* mask, Tensor& dx);

  /// The values of the tensors were changed.
  void weights_changed();

 private:
  enum class Algorithm { winograd, rgb, im2col };
  Algorithm algorithm() const;
  const float* bias() const { return bias_.empty() ? nullptr : bias_.data(); }
  const WinogradWeights& winograd_weights(Shape out, Mode mode) const;
  void forward_im2col(const Tensor& x, const ConvolutionEpilogue& epilogue, Tensor& y) const;
  void weight_gradient_im2col(const Tensor& x, const Tensor& dy, bool add, float* gradient) const;
  void input_gradient_im2col(const Tensor& x, const Tensor& dy, Tensor& dx) const;

  Conv2dOptions options_;
  const Tensor& weight_;
  const Tensor& bias_;
  // Made when first needed: for forward, one for each tile, and for the gradient of x.
  mutable std::mutex making_weights_;
  mutable std::list<WinogradWeights> winograd_weights_;  // never move: others read them
  WinogradWeights winograd_transposed_;
};

}  // namespace sdmt::nn
