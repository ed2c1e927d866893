// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/batch_norm.h"

#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "channel_affine.h"
#include "channel_shards.h"
#include "kernels/channel_norm.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void BatchNormOptions::validate() const {
  io::require(num_features >= 1, "BatchNorm: num_features", num_features, ">= 1");
  io::require(eps > 0.0, "BatchNorm: eps", eps, "> 0");
  io::require_in("BatchNorm: momentum", momentum, 0.0, 1.0);
}

BatchNorm::BatchNorm(BatchNormOptions options)
    : NormLayer((options.validate(), options.num_features), options.initial_gamma,
                options.initial_beta),
      options_(options),
      batch_(std::make_unique<ChannelStatistics>()) {
  const Shape shape = gamma().shape();
  running_mean_ = {"running_mean", Tensor(shape)};
  running_var_ = {"running_var", Tensor(shape)};
  running_var_.value.fill(1.0F);
}

BatchNorm::~BatchNorm() = default;

Shape BatchNorm::output_shape(Shape in) const {
  if (in.c != options_.num_features) {
    throw std::invalid_argument("BatchNorm: input is " + in.str() + ", expected " +
                                std::to_string(options_.num_features) + " channels");
  }
  return in;
}

void BatchNorm::infer(const Tensor& x, Tensor& y) const {
  output_shape(x.shape());
  channel_affine(x, affine(running_statistics()), y);
}

void BatchNorm::train(const Tensor& x, Tensor& y, bool relu) {
  output_shape(x.shape());
  if (frozen_) {
    *batch_ = running_statistics();
  } else {
    move_to_batch(x);
  }
  ChannelAffine steps = affine(*batch_);
  steps.relu = relu;
  channel_affine(x, steps, y);
}

void BatchNorm::move_to_batch(const Tensor& x) {
  const int channels = options_.num_features;
  const BatchShards shards = shards_of(x);
  const double rows = static_cast<double>(shards.images()) * x.shape().h * x.shape().w;
  if (rows < 2) {
    throw std::invalid_argument("BatchNorm: training input is " + x.shape().str() +
                                ", expected more than one value per channel");
  }
  ChannelMoments moments = moments_of_batch(x, shards);
  batch_->inv_std.resize(moments.mean.size());
  const auto move = [this](float& running, double value) {
    running += static_cast<float>(options_.momentum * (value - running));
  };
  for (int c = 0; c < channels; ++c) {
    move(running_mean_.value.data()[c], moments.mean[c]);
    move(running_var_.value.data()[c], moments.squares[c] / (rows - 1));
    batch_->inv_std[c] = 1.0 / std::sqrt(moments.squares[c] / rows + options_.eps);
  }
  batch_->mean = std::move(moments.mean);
}

ChannelStatistics BatchNorm::running_statistics() const {
  const std::span<const float> mean = running_mean_.value.values();
  ChannelStatistics statistics{ChannelValues(mean.begin(), mean.end()), {}};
  for (const float variance : running_var_.value.values()) {
    statistics.inv_std.push_back(1.0 / std::sqrt(variance + options_.eps));
  }
  return statistics;
}

ChannelAffine BatchNorm::affine(const ChannelStatistics& statistics) const {
  return affine_of(statistics, gamma(), beta());
}

void BatchNorm::gradients(const Tensor& x, const Tensor& dy, Tensor* dx, bool relu) {
  ChannelAffine forward = affine(*batch_);
  forward.relu = relu;
  const BatchShards shards = shards_of(x);
  const ChannelGradientSums sums = gradient_sums_of_batch(x, dy, *batch_, forward, shards);
  add_to_gradient(sums.dy_by_x, weight());
  add_to_gradient(sums.dy, bias());
  if (dx == nullptr) return;
  const double rows = static_cast<double>(shards.images()) * x.shape().h * x.shape().w;
  // Frozen statistics do not depend on x.
  channel_input_gradient(x, dy, *batch_, forward, frozen_ ? zero_sums(options_.num_features) : sums,
                         rows, *dx);
}

}  // namespace sdmt::nn
