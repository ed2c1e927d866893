// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/l2_normalize.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sdmt::nn {

namespace {

double norm(const float* row, std::size_t size) {
  double sum = 0.0;
  for (std::size_t i = 0; i < size; ++i) sum += static_cast<double>(row[i]) * row[i];
  return std::sqrt(sum);
}

}  // namespace

void L2Normalize::infer(const Tensor& x, Tensor& y) const {
  y.resize(x.shape());
  const std::size_t size = x.shape().image_size();
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int n = 0; n < x.shape().n; ++n) {
    const double scale = 1.0 / std::max(norm(x.image(n), size), kEps);
    for (std::size_t i = 0; i < size; ++i) {
      y.image(n)[i] = static_cast<float>(x.image(n)[i] * scale);
    }
  }
}

void L2Normalize::backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) {
  if (dx == nullptr) return;
  dx->resize(x.shape());
  const std::size_t size = x.shape().image_size();
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int n = 0; n < x.shape().n; ++n) {
    const double length = norm(x.image(n), size);
    const double scale = 1.0 / std::max(length, kEps);
    // Below eps the divisor is constant; above, the part of dy along y is lost.
    double along = 0.0;
    if (length > kEps) {
      for (std::size_t i = 0; i < size; ++i) {
        along += static_cast<double>(y.image(n)[i]) * dy.image(n)[i];
      }
    }
    for (std::size_t i = 0; i < size; ++i) {
      dx->image(n)[i] = static_cast<float>(scale * (dy.image(n)[i] - along * y.image(n)[i]));
    }
  }
}

}  // namespace sdmt::nn
