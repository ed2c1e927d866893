// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/clip_grad_norm.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

namespace {

/// Sum of squares in a fixed order: parts of fixed length, each in double.
double squared_norm(const Tensor& tensor) {
  constexpr std::int64_t kPart = 1 << 16;
  const auto size = static_cast<std::int64_t>(tensor.size());
  std::vector<double> sums((size + kPart - 1) / kPart);
  // nothing throws
#pragma omp parallel for schedule(static)
  for (std::size_t part = 0; part < sums.size(); ++part) {
    const std::int64_t begin = static_cast<std::int64_t>(part) * kPart;
    const std::int64_t end = std::min(size, begin + kPart);
    double sum = 0.0;
    for (std::int64_t i = begin; i < end; ++i) {
      sum += static_cast<double>(tensor.data()[i]) * tensor.data()[i];
    }
    sums[part] = sum;
  }
  double total = 0.0;
  for (const double sum : sums) total += sum;
  return total;
}

}  // namespace

double clip_grad_norm(const std::vector<NamedParameter>& parameters, double max_norm) {
  io::require(max_norm > 0.0, "clip_grad_norm: max_norm", max_norm, "> 0");
  double sum = 0.0;
  for (const NamedParameter& named : parameters) {
    if (named.parameter->trainable) sum += squared_norm(named.parameter->grad);
  }
  const double norm = std::sqrt(sum);
  if (!std::isfinite(norm) || norm <= max_norm) return norm;
  const auto scale = static_cast<float>(max_norm / (norm + 1e-6));
  for (const NamedParameter& named : parameters) {
    if (!named.parameter->trainable) continue;
    const auto size = static_cast<std::int64_t>(named.parameter->grad.size());
    float* const gradient = named.parameter->grad.data();
#pragma omp parallel for simd schedule(static)
    for (std::int64_t i = 0; i < size; ++i) gradient[i] *= scale;
  }
  return norm;
}

}  // namespace sdmt::nn
