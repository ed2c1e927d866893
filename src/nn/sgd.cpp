// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/sgd.h"

#include <cstdint>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void SgdOptions::validate() const {
  io::require(learning_rate >= 0.0, "SGD: learning_rate", learning_rate, ">= 0");
  io::require(momentum >= 0.0 && momentum < 1.0, "SGD: momentum", momentum, "a value in [0,1)");
  io::require(weight_decay >= 0.0, "SGD: weight_decay", weight_decay, ">= 0");
}

Sgd::Sgd(std::vector<NamedParameter> parameters, SgdOptions options)
    : Optimizer(std::move(parameters), options.learning_rate), options_(options) {
  options_.validate();
  for (const NamedParameter& named : this->parameters()) {
    momentum_.emplace_back(named.parameter->value.shape());
  }
}

void Sgd::step() {
  for (std::size_t p = 0; p < momentum_.size(); ++p) {
    Parameter& parameter = *parameters()[p].parameter;
    if (!is_stepped(parameter)) continue;
    const auto size = static_cast<std::int64_t>(parameter.value.size());
    const auto rate = static_cast<float>(learning_rate() * parameter.lr_scale);
    const auto momentum = static_cast<float>(options_.momentum);
    const float decay = parameter.decay ? static_cast<float>(options_.weight_decay) : 0.0F;
    float* const weight = parameter.value.data();
    const float* const gradient = parameter.grad.data();
    float* const velocity = momentum_[p].data();
#pragma omp parallel for simd schedule(static)
    for (std::int64_t i = 0; i < size; ++i) {
      velocity[i] = momentum * velocity[i] + (gradient[i] + decay * weight[i]);
      weight[i] -= rate * velocity[i];
    }
  }
}

std::vector<NamedTensor> Sgd::state() {
  std::vector<NamedTensor> tensors;
  for (std::size_t p = 0; p < momentum_.size(); ++p) {
    tensors.push_back({parameters()[p].name + ".momentum_buffer", &momentum_[p]});
  }
  return tensors;
}

}  // namespace sdmt::nn
