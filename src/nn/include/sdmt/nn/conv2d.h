// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/random.h"

namespace sdmt::nn {

class Convolution;
class GradientSum;

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

/// Cross-correlation with zero padding, as torch.nn.Conv2d:
/// y[n,i,j,o] = bias[o] + sum over u,v,c of x[n, i*stride+u-padding, j*stride+v-padding, c] *
/// weight[o,u,v,c]. x is [n,h,w,in_channels]; y is [n,h',w',out_channels] with h' = (h + 2 padding
/// - kernel) / stride + 1.
///
/// 3x3 convolutions of stride 1 and padding 1 run by Winograd's minimal filtering (Lavin & Gray,
/// "Fast Algorithms for Convolutional Neural Networks", CVPR 2016), those of three channels and
/// stride 1 or 2 directly, all others by a matrix product. Training takes tiles of 4x4, which
/// differ from the sum above by about 1e-6 of the largest output; inference takes tiles of 8x8
/// where they save multiplications, which differ by about 2e-5. (The embedding of the whole network
/// differs by 2e-7.)
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
  void infer(const Tensor& x, Tensor& y) const override;
  void forward(const Tensor& x, Tensor& y, Mode mode) override;
  /// Does not read y.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;
  std::vector<Parameter*> parameters() override;
  void parameters_changed() override;

 private:
  friend class InferencePlan;  // these run it together with its neighbours
  friend class TrainingPlan;
  void add_parameter_gradients(const Tensor& x, const Tensor& dy);

  Conv2dOptions options_;
  Parameter weight_;
  Parameter bias_;
  std::unique_ptr<Convolution> convolution_;
  std::unique_ptr<GradientSum> gradient_sum_;
};

}  // namespace sdmt::nn
