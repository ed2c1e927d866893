// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/instance_norm.h"

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "channel_affine.h"
#include "channel_shards.h"
#include "kernels/channel_norm.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/first_error.h"

namespace sdmt::nn {

namespace {

ChannelStatistics statistics_of(const Tensor& image, double eps) {
  const std::int64_t rows = rows_of(image.shape());
  ChannelMoments moments = std::move(channel_moments(image, {0, rows}).front());
  ChannelStatistics statistics{std::move(moments.mean), std::move(moments.squares)};
  for (double& value : statistics.inv_std)
    value = 1.0 / std::sqrt(value / static_cast<double>(rows) + eps);
  return statistics;
}

}  // namespace

void InstanceNormOptions::validate() const {
  io::require(num_features >= 1, "InstanceNorm: num_features", num_features, ">= 1");
  io::require(eps > 0.0, "InstanceNorm: eps", eps, "> 0");
}

InstanceNorm::InstanceNorm(InstanceNormOptions options)
    : NormLayer((options.validate(), options.num_features), options.initial_gamma,
                options.initial_beta),
      options_(options) {}

InstanceNorm::~InstanceNorm() = default;

Shape InstanceNorm::output_shape(Shape in) const {
  if (in.c != options_.num_features || in.h * in.w < 2) {
    throw std::invalid_argument("InstanceNorm: input is " + in.str() + ", expected " +
                                std::to_string(options_.num_features) +
                                " channels and more than one position");
  }
  return in;
}

void InstanceNorm::infer(const Tensor& x, Tensor& y) const { normalise(x, y, false, nullptr); }

void InstanceNorm::train(const Tensor& x, Tensor& y, bool relu) {
  images_.resize(x.shape().n);
  normalise(x, y, relu, images_.data());
}

void InstanceNorm::normalise(const Tensor& x, Tensor& y, bool relu, ChannelStatistics* kept) const {
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
      ChannelAffine affine = affine_of(statistics, gamma(), beta());
      affine.relu = relu;
      channel_affine(from, affine, to);
      if (kept != nullptr) kept[i] = std::move(statistics);
    });
  }
  error.rethrow();
}

void InstanceNorm::gradients(const Tensor& x, const Tensor& dy, Tensor* dx, bool relu) {
  const int images = x.shape().n;
  if (dx != nullptr) dx->resize(x.shape());
  std::vector<ChannelGradientSums> sums(images);
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < images; ++i) {
    error.guard([&] {
      const Tensor from = x.images(i, 1);
      const Tensor gradient = dy.images(i, 1);
      ChannelAffine affine = affine_of(images_[i], gamma(), beta());
      affine.relu = relu;
      const std::int64_t rows = rows_of(from.shape());
      sums[i] =
          std::move(channel_gradient_sums(from, gradient, images_[i], affine, {0, rows}).front());
      if (dx == nullptr) return;
      Tensor to = dx->images(i, 1);
      channel_input_gradient(from, gradient, images_[i], affine, sums[i], static_cast<double>(rows),
                             to);
    });
  }
  error.rethrow();
  if (!weight().trainable && !bias().trainable) return;
  const BatchShards shards = shards_of(x);
  std::vector<ChannelGradientSums> parts(kShards, zero_sums(options_.num_features));
  for (int s = shards.first(); s < shards.end(); ++s) {
    const int first = shards.begin(shards.first());
    for (int i = shards.begin(s); i < shards.begin(s + 1); ++i) {
      add_sums(sums[i - first], parts[s]);
    }
  }
  const ChannelGradientSums total = sum_of_shards(std::move(parts), shards);
  add_to_gradient(total.dy_by_x, weight());
  add_to_gradient(total.dy, bias());
}

}  // namespace sdmt::nn
