// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/adam.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void AdamOptions::validate() const {
  io::require(learning_rate >= 0.0, "Adam: learning_rate", learning_rate, ">= 0");
  io::require(beta1 >= 0.0 && beta1 < 1.0, "Adam: beta1", beta1, "a value in [0,1)");
  io::require(beta2 >= 0.0 && beta2 < 1.0, "Adam: beta2", beta2, "a value in [0,1)");
  io::require(eps > 0.0, "Adam: eps", eps, "> 0");
  io::require(weight_decay >= 0.0, "Adam: weight_decay", weight_decay, ">= 0");
}

Adam::Adam(std::vector<NamedParameter> parameters, AdamOptions options)
    : Optimizer(std::move(parameters), options.learning_rate), options_(options) {
  options_.validate();
  for (const NamedParameter& named : this->parameters()) {
    const Shape shape = named.parameter->value.shape();
    moments_.push_back({Tensor(shape), Tensor(shape), Tensor({1, 1, 1, 1})});
  }
}

void Adam::step() {
  for (std::size_t p = 0; p < moments_.size(); ++p) {
    Parameter& parameter = *parameters()[p].parameter;
    if (!is_stepped(parameter)) continue;
    Moments& moments = moments_[p];
    const double t = moments.step.data()[0] += 1.0F;
    const auto size = static_cast<std::int64_t>(parameter.value.size());
    const auto rate = static_cast<float>(learning_rate() * parameter.lr_scale /
                                         (1.0 - std::pow(options_.beta1, t)));
    const auto root = static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(options_.beta2, t)));
    const auto beta1 = static_cast<float>(options_.beta1);
    const auto beta2 = static_cast<float>(options_.beta2);
    const auto rest1 = static_cast<float>(1.0 - options_.beta1);
    const auto rest2 = static_cast<float>(1.0 - options_.beta2);
    const auto eps = static_cast<float>(options_.eps);
    const float decay = parameter.decay ? static_cast<float>(options_.weight_decay) : 0.0F;
    float* const weight = parameter.value.data();
    const float* const gradient = parameter.grad.data();
    float* const first = moments.first.data();
    float* const second = moments.second.data();
#pragma omp parallel for simd schedule(static)
    for (std::int64_t i = 0; i < size; ++i) {
      const float g = gradient[i] + decay * weight[i];
      first[i] = beta1 * first[i] + rest1 * g;
      second[i] = beta2 * second[i] + rest2 * g * g;
      weight[i] -= rate * first[i] / (std::sqrt(second[i]) * root + eps);
    }
  }
}

std::vector<NamedTensor> Adam::state() {
  std::vector<NamedTensor> tensors;
  for (std::size_t p = 0; p < moments_.size(); ++p) {
    const std::string& name = parameters()[p].name;
    tensors.push_back({name + ".exp_avg", &moments_[p].first});
    tensors.push_back({name + ".exp_avg_sq", &moments_[p].second});
    tensors.push_back({name + ".step", &moments_[p].step});
  }
  return tensors;
}

}  // namespace sdmt::nn
