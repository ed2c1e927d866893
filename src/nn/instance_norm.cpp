// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/instance_norm.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "channel_parameters.h"
#include "kernels/channel_norm.h"
#include "parameter_access.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/first_error.h"

namespace sdmt::nn {

namespace {

ChannelStatistics statistics_of(const Tensor& image, double eps) {
  ChannelMoments moments = channel_moments(image);
  const double rows = static_cast<double>(image.size()) / image.shape().c;
  ChannelStatistics statistics{std::move(moments.mean), std::move(moments.squares)};
  for (double& value : statistics.inv_std) value = 1.0 / std::sqrt(value / rows + eps);
  return statistics;
}

}  // namespace

void InstanceNormOptions::validate() const {
  io::require(num_features >= 1, "InstanceNorm: num_features", num_features, ">= 1");
  io::require(eps > 0.0, "InstanceNorm: eps", eps, "> 0");
}

InstanceNorm::InstanceNorm(InstanceNormOptions options) : options_(options) {
  options_.validate();
  weight_ = channel_parameter("weight", options_.num_features, options_.initial_gamma);
  bias_ = channel_parameter("bias", options_.num_features, options_.initial_beta);
}

InstanceNorm::~InstanceNorm() = default;

Shape InstanceNorm::output_shape(Shape in) const {
  if (in.c != options_.num_features || in.h * in.w < 2) {
    throw std::invalid_argument("InstanceNorm: input is " + in.str() + ", expected " +
                                std::to_string(options_.num_features) +
                                " channels and more than one position");
  }
  return in;
}

void InstanceNorm::infer(const Tensor& x, Tensor& y) const { normalise(x, y, nullptr); }

void InstanceNorm::forward(const Tensor& x, Tensor& y, Mode mode) {
  if (mode == Mode::inference) return infer(x, y);
  images_.resize(x.shape().n);
  normalise(x, y, images_.data());
}

void InstanceNorm::normalise(const Tensor& x, Tensor& y, ChannelStatistics* kept) const {
  output_shape(x.shape());
  y.resize(x.shape());
  const int images = x.shape().n;
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < images; ++i) {
    error.guard([&] {
      const Tensor from = x.images(i, 1);
      Tensor to = y.images(i, 1);
      ChannelStatistics statistics = statistics_of(from, options_.eps);
      channel_affine(from, affine_of(statistics, weight_.value, bias_.value), to);
      if (kept != nullptr) kept[i] = std::move(statistics);
    });
  }
  error.rethrow();
}

void InstanceNorm::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  const int images = x.shape().n;
  if (dx != nullptr) dx->resize(x.shape());
  std::vector<ChannelGradientSums> sums(images);
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < images; ++i) {
    error.guard([&] {
      const Tensor from = x.images(i, 1);
      const Tensor gradient = dy.images(i, 1);
      const ChannelAffine affine = affine_of(images_[i], weight_.value, bias_.value);
      sums[i] = channel_gradient_sums(from, gradient, images_[i], affine);
      if (dx == nullptr) return;
      Tensor to = dx->images(i, 1);
      channel_input_gradient(from, gradient, images_[i], affine, sums[i], to);
    });
  }
  error.rethrow();
  const auto add = [&](Parameter& parameter, ChannelValues ChannelGradientSums::*sum) {
    if (!parameter.trainable) return;
    float* const to = gradient_of(parameter);
    for (int c = 0; c < options_.num_features; ++c) {
      double total = 0.0;
      for (const ChannelGradientSums& image : sums) total += (image.*sum)[c];
      to[c] += static_cast<float>(total);
    }
  };
  add(weight_, &ChannelGradientSums::dy_by_x);
  add(bias_, &ChannelGradientSums::dy);
}

}  // namespace sdmt::nn
