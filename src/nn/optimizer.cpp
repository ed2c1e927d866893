// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/optimizer.h"

#include <cmath>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

Optimizer::Optimizer(std::vector<NamedParameter> parameters, double learning_rate)
    : parameters_(std::move(parameters)) {
  set_learning_rate(learning_rate);
}

void Optimizer::zero_grad() {
  for (const NamedParameter& named : parameters_) named.parameter->grad.fill(0.0F);
}

void Optimizer::set_learning_rate(double learning_rate) {
  io::require(learning_rate >= 0.0 && std::isfinite(learning_rate), "Optimizer: learning_rate",
              learning_rate, ">= 0");
  learning_rate_ = learning_rate;
}

bool Optimizer::is_stepped(const Parameter& parameter) {
  return parameter.trainable && !parameter.grad.empty();
}

}  // namespace sdmt::nn
