// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/batch_norm.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "parameter_access.h"

namespace sdmt::nn {

namespace {

[[noreturn]] void refuse(const std::string& field, double value, const char* expected) {
  throw std::invalid_argument("BatchNorm: " + field + " is " + std::to_string(value) +
                              ", expected " + expected);
}

}  // namespace

void BatchNormOptions::validate() const {
  if (num_features < 1) refuse("num_features", num_features, ">= 1");
  if (!(eps > 0.0)) refuse("eps", eps, "> 0");
  if (!(momentum >= 0.0 && momentum <= 1.0)) refuse("momentum", momentum, "a value in [0,1]");
}

BatchNorm::BatchNorm(BatchNormOptions options) : options_(options) {
  options_.validate();
  const Shape shape{1, 1, 1, options_.num_features};
  weight_.name = "weight";
  weight_.value = Tensor(shape);
  weight_.value.fill(options_.initial_gamma);
  bias_.name = "bias";
  bias_.value = Tensor(shape);
  bias_.value.fill(options_.initial_beta);
  weight_.decay = bias_.decay = false;
  running_mean_ = {"running_mean", Tensor(shape)};
  running_var_ = {"running_var", Tensor(shape)};
  running_var_.value.fill(1.0F);
  batch_mean_.resize(static_cast<std::size_t>(options_.num_features));
  batch_inv_std_.resize(static_cast<std::size_t>(options_.num_features));
}

Shape BatchNorm::output_shape(Shape in) const {
  if (in.c != options_.num_features) {
    throw std::invalid_argument("BatchNorm: input is " + in.str() + ", expected " +
                                std::to_string(options_.num_features) + " channels");
  }
  return in;
}

void BatchNorm::forward(const Tensor& x, Tensor& y, Mode mode) {
  y.resize(output_shape(x.shape()));
  const int channels = options_.num_features;
  const auto rows = static_cast<std::int64_t>(x.size()) / channels;
  if (mode == Mode::training && rows < 2) {
    throw std::invalid_argument("BatchNorm: training input is " + x.shape().str() +
                                ", expected more than one value per channel");
  }
  // A channel at a time, in double: the layer sees a few hundred rows of 128 values.
#pragma omp parallel for schedule(static)
  for (int c = 0; c < channels; ++c) {
    double mean = running_mean_.value.data()[c];
    double variance = running_var_.value.data()[c];
    if (mode == Mode::training) {
      mean = 0.0;
      for (std::int64_t i = 0; i < rows; ++i) mean += x.data()[i * channels + c];
      mean /= static_cast<double>(rows);
      variance = 0.0;
      for (std::int64_t i = 0; i < rows; ++i) {
        const double centred = x.data()[i * channels + c] - mean;
        variance += centred * centred;
      }
      const double unbiased = variance / static_cast<double>(rows - 1);
      variance /= static_cast<double>(rows);
      const auto move = [this](float& running, double value) {
        running += static_cast<float>(options_.momentum * (value - running));
      };
      move(running_mean_.value.data()[c], mean);
      move(running_var_.value.data()[c], unbiased);
    }
    const double inv_std = 1.0 / std::sqrt(variance + options_.eps);
    if (mode == Mode::training) {
      batch_mean_[static_cast<std::size_t>(c)] = mean;
      batch_inv_std_[static_cast<std::size_t>(c)] = inv_std;
    }
    const double scale = weight_.value.data()[c] * inv_std;
    const double shift = bias_.value.data()[c] - mean * scale;
    for (std::int64_t i = 0; i < rows; ++i) {
      y.data()[i * channels + c] = static_cast<float>(x.data()[i * channels + c] * scale + shift);
    }
  }
}

void BatchNorm::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  const int channels = options_.num_features;
  const auto rows = static_cast<std::int64_t>(x.size()) / channels;
  if (dx != nullptr) dx->resize(x.shape());
  float* const weight_gradient = weight_.trainable ? gradient_of(weight_) : nullptr;
  float* const bias_gradient = bias_.trainable ? gradient_of(bias_) : nullptr;
#pragma omp parallel for schedule(static)
  for (int c = 0; c < channels; ++c) {
    const double mean = batch_mean_[static_cast<std::size_t>(c)];
    const double inv_std = batch_inv_std_[static_cast<std::size_t>(c)];
    double sum = 0.0;         // of dy
    double sum_with_x = 0.0;  // of dy times the normalised x
    for (std::int64_t i = 0; i < rows; ++i) {
      const double g = dy.data()[i * channels + c];
      sum += g;
      sum_with_x += g * (x.data()[i * channels + c] - mean) * inv_std;
    }
    if (weight_gradient != nullptr) weight_gradient[c] += static_cast<float>(sum_with_x);
    if (bias_gradient != nullptr) bias_gradient[c] += static_cast<float>(sum);
    if (dx == nullptr) continue;
    // Mean and variance depend on x too; their share removes the mean of dy and its part along x.
    const double scale = weight_.value.data()[c] * inv_std;
    const double mean_dy = sum / static_cast<double>(rows);
    const double mean_dy_x = sum_with_x / static_cast<double>(rows);
    for (std::int64_t i = 0; i < rows; ++i) {
      const std::int64_t at = i * channels + c;
      const double normalised = (x.data()[at] - mean) * inv_std;
      dx->data()[at] =
          static_cast<float>(scale * (dy.data()[at] - mean_dy - normalised * mean_dy_x));
    }
  }
}

}  // namespace sdmt::nn
