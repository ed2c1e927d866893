// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/random.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// Standard normal values.
inline Tensor random_tensor(Shape shape, Random& random) {
  Tensor tensor(shape);
  for (float& value : tensor.values()) value = static_cast<float>(random.normal());
  return tensor;
}

/// Uniform in [low, high], as int.
inline int random_int(int low, int high, Random& random) {
  return low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low) + 1));
}

}  // namespace sdmt::nn
