// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/random.h"

namespace sdmt::nn {

class WinogradWeights;

struct Conv2dOptions {
  int in_channels = 0;   ///< >= 1
  int out_channels = 0;  ///< >= 1
  int kernel_size = 3;   ///< square, >= 1
  int stride = 1;        ///< >= 1
  int padding = 1;       ///< zeros on every side, >= 0
  bool bias = true;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// What a convolution may do to its output before it is stored, to save a pass over memory.
enum class Fusion { none, relu, relu_max_pool };

/// Cross-correlation with zero padding, as torch.nn.Conv2d:
/// y[n,i,j,o] = bias[o] + sum over u,v,c of x[n, i*stride+u-padding, j*stride+v-padding, c] *
/// weight[o,u,v,c]. x is [n,h,w,in_channels]; y is [n,h',w',out_channels] with h' = (h + 2 padding
/// - kernel) / stride + 1.
///
/// 3x3 convolutions of stride 1 and padding 1 run by Winograd's minimal filtering (Lavin & Gray,
/// "Fast Algorithms for Convolutional Neural Networks", CVPR 2016), all others by a matrix product.
/// Training takes tiles of 4x4, which differ from the sum above by about 1e-6 of the largest
/// output; inference takes tiles of 8x8 where they save multiplications, which differ by about
/// 2e-5. (The embedding of the whole network differs by 2e-7.)
class Conv2d : public Layer {
 public:
  /// Weights and biases are zero until set or reset_parameters(). Throws as
  /// Conv2dOptions::validate().
  explicit Conv2d(Conv2dOptions options);
  ~Conv2d() override;

  const Conv2dOptions& options() const { return options_; }

  /// [out_channels, kernel_size, kernel_size, in_channels]
  Parameter& weight() { return weight_; }
  /// [1,1,1,out_channels]; empty without bias.
  Parameter& bias() { return bias_; }

  /// He initialisation: weights normal with variance 2 / (kernel_size^2 in_channels), biases zero.
  void reset_parameters(Random& random);

  std::string_view type() const override { return "Conv2d"; }
  Shape output_shape(Shape in) const override;
  void forward(const Tensor& x, Tensor& y, Mode mode) override;
  /// forward() followed by ReLU, or by ReLU and a 2x2 max pool of stride 2, in one pass. The values
  /// are those of the separate layers.
  void forward_fused(const Tensor& x, Tensor& y, Fusion fusion, Mode mode = Mode::inference);
  /// Whether forward_after() is made for this layer on that one.
  bool can_follow(const Conv2d& first) const;
  /// forward_fused() for inference on first.forward_fused(x, ..., Fusion::relu), whose result is
  /// made where it is needed and never stored whole. The values are the same.
  void forward_after(Conv2d& first, const Tensor& x, Tensor& y, Fusion fusion);
  /// Does not read y.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;
  /// backward() through this layer and a ReLU below it, whose result x is: dx is the gradient
  /// before that ReLU.
  void backward_through_relu(const Tensor& x, const Tensor& dy, Tensor& dx);
  std::vector<Parameter*> parameters() override;
  void parameters_changed() override;

 private:
  enum class Algorithm { winograd, rgb, im2col };
  Algorithm algorithm() const;
  const float* bias_data() const { return options_.bias ? bias_.value.data() : nullptr; }
  const WinogradWeights& winograd_weights(Shape out, Mode mode);
  void forward_im2col(const Tensor& x, const float* bias, bool relu, Tensor& y);
  void add_parameter_gradients(const Tensor& x, const Tensor& dy);
  void weight_gradient_im2col(const Tensor& x, const Tensor& dy, float* gradient);
  void input_gradient_winograd(const Tensor& dy, const Tensor* mask, Tensor& dx);
  void input_gradient_im2col(const Tensor& x, const Tensor& dy, Tensor& dx);

  Conv2dOptions options_;
  Parameter weight_;
  Parameter bias_;
  // Transformed weights for forward and for the gradient of x, made when first needed.
  std::unique_ptr<WinogradWeights> winograd_small_;  // 4x4
  std::unique_ptr<WinogradWeights> winograd_large_;  // 8x8
  std::unique_ptr<WinogradWeights> winograd_transposed_;
};

}  // namespace sdmt::nn
