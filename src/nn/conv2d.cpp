// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/conv2d.h"

#include "convolution.h"
#include "gradient_sum.h"
#include "parameter_access.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void Conv2dOptions::validate() const {
  io::require(in_channels >= 1, "Conv2d: in_channels", in_channels, ">= 1");
  io::require(out_channels >= 1, "Conv2d: out_channels", out_channels, ">= 1");
  io::require(kernel_size >= 1, "Conv2d: kernel_size", kernel_size, ">= 1");
  io::require(stride >= 1, "Conv2d: stride", stride, ">= 1");
  io::require(padding >= 0, "Conv2d: padding", padding, ">= 0");
}

Conv2d::Conv2d(Conv2dOptions options) : options_(options) {
  options_.validate();
  const int k = options_.kernel_size;
  weight_.name = "weight";
  weight_.value = Tensor({options_.out_channels, k, k, options_.in_channels});
  bias_.name = "bias";
  bias_.decay = false;
  if (options_.bias) bias_.value = Tensor({1, 1, 1, options_.out_channels});
  convolution_ = std::make_unique<Convolution>(options_, weight_.value, bias_.value);
  gradient_sum_ = std::make_unique<GradientSum>();
}

Conv2d::~Conv2d() = default;

void Conv2d::reset_parameters(Random& random) {
  he_normal(weight_.value, static_cast<double>(weight_.value.shape().image_size()), random);
  if (options_.bias) bias_.value.fill(0.0F);
  parameters_changed();
}

Shape Conv2d::output_shape(Shape in) const { return convolution_->output_shape(in); }

void Conv2d::infer(const Tensor& x, Tensor& y) const {
  convolution_->forward(x, {}, Mode::inference, y);
}

void Conv2d::forward(const Tensor& x, Tensor& y, Mode mode) {
  convolution_->forward(x, {}, mode, y);
}

void Conv2d::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  add_parameter_gradients(x, dy);
  if (dx != nullptr) convolution_->input_gradient(x, dy, nullptr, *dx);
}

void Conv2d::add_parameter_gradients(const Tensor& x, const Tensor& dy) {
  gradient_sum_->start(shards_of(x), parameters());
  gradient_sum_->add_shards(
      [&](int first, int count, bool add, const std::vector<float*>& sums) {
        convolution_->parameter_sums(x.images(first, count), dy.images(first, count), add, sums[0],
                                     options_.bias ? sums[1] : nullptr);
      },
      [&](int parameter, std::span<const float> sums, float* gradient) {
        convolution_->add_gradient(parameter == 0, sums, gradient);
      });
  gradient_sum_->finish();
}

std::vector<Parameter*> Conv2d::parameters() {
  if (options_.bias) return {&weight_, &bias_};
  return {&weight_};
}

void Conv2d::parameters_changed() { convolution_->weights_changed(); }

}  // namespace sdmt::nn
