// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/max_pool2d.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>

#include "kernels/max_pool_gradient.h"

namespace sdmt::nn {

Shape MaxPool2d::output_shape(Shape in) const {
  if (in.h < 2 || in.w < 2) {
    throw std::invalid_argument("MaxPool2d: input is " + in.str() +
                                ", expected at least 2 rows and 2 columns");
  }
  return {in.n, in.h / 2, in.w / 2, in.c};
}

void MaxPool2d::infer(const Tensor& x, Tensor& y) const {
  const Shape in = x.shape();
  const Shape out = output_shape(in);
  y.resize(out);
  const std::ptrdiff_t in_row = static_cast<std::ptrdiff_t>(in.w) * in.c;
  // nothing throws
#pragma omp parallel for collapse(2) schedule(static)
  for (int n = 0; n < out.n; ++n) {
    for (int i = 0; i < out.h; ++i) {
      const float* top = x.image(n) + 2 * i * in_row;
      float* to = y.image(n) + static_cast<std::ptrdiff_t>(i) * out.w * out.c;
      for (int j = 0; j < out.w; ++j, top += 2 * in.c, to += out.c) {
        for (int c = 0; c < in.c; ++c) {
          to[c] = std::max(std::max(top[c], top[in.c + c]),
                           std::max(top[in_row + c], top[in_row + in.c + c]));
        }
      }
    }
  }
}

void MaxPool2d::backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) {
  // Every value is larger than the bound, NaN included.
  constexpr float kNone = -std::numeric_limits<float>::infinity();
  if (dx != nullptr) max_pool_gradient(x, y, dy, kNone, *dx);
}

void MaxPool2d::backward_through_relu(const Tensor& x, const Tensor& y, const Tensor& dy,
                                      Tensor& dx) {
  max_pool_gradient(x, y, dy, 0.0F, dx);
}

}  // namespace sdmt::nn
