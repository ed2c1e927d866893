// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/random.h"

namespace sdmt::nn {

/// The gradient of a parameter, made (as zeros) the first time.
inline float* gradient_of(Parameter& parameter) {
  if (parameter.grad.empty()) parameter.grad = Tensor(parameter.value.shape());
  return parameter.grad.data();
}

/// Values normal with variance 2 / fan_in: He et al., "Delving Deep into Rectifiers", 2015.
inline void he_normal(Tensor& values, double fan_in, Random& random) {
  const double deviation = std::sqrt(2.0 / fan_in);
  for (float& value : values.values()) value = static_cast<float>(deviation * random.normal());
}

}  // namespace sdmt::nn
