// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/relu.h"

#include <cstdint>

namespace sdmt::nn {

void ReLU::infer(const Tensor& x, Tensor& y) const {
  y.resize(x.shape());
  const auto size = static_cast<std::int64_t>(x.size());
  const float* const from = x.data();
  float* const to = y.data();
#pragma omp parallel for simd schedule(static)
  for (std::int64_t i = 0; i < size; ++i) to[i] = from[i] < 0.0F ? 0.0F : from[i];
}

void ReLU::backward(const Tensor&, const Tensor& y, const Tensor& dy, Tensor* dx) {
  if (dx == nullptr) return;
  dx->resize(dy.shape());
  const auto size = static_cast<std::int64_t>(dy.size());
  const float* const result = y.data();
  const float* const from = dy.data();
  float* const to = dx->data();
#pragma omp parallel for simd schedule(static)
  for (std::int64_t i = 0; i < size; ++i) to[i] = result[i] > 0.0F ? from[i] : 0.0F;
}

}  // namespace sdmt::nn
