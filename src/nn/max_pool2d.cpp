// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/max_pool2d.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace sdmt::nn {

Shape MaxPool2d::output_shape(Shape in) const {
  if (in.h < 2 || in.w < 2) {
    throw std::invalid_argument("MaxPool2d: input is " + in.str() +
                                ", expected at least 2 rows and 2 columns");
  }
  return {in.n, in.h / 2, in.w / 2, in.c};
}

void MaxPool2d::forward(const Tensor& x, Tensor& y, Mode) {
  const Shape in = x.shape();
  const Shape out = output_shape(in);
  y.resize(out);
  const std::ptrdiff_t in_row = static_cast<std::ptrdiff_t>(in.w) * in.c;
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
  if (dx != nullptr) route(x, y, dy, -std::numeric_limits<float>::infinity(), *dx);
}

void MaxPool2d::backward_through_relu(const Tensor& x, const Tensor& y, const Tensor& dy,
                                      Tensor& dx) {
  route(x, y, dy, 0.0F, dx);
}

void MaxPool2d::route(const Tensor& x, const Tensor& y, const Tensor& dy, float bound, Tensor& dx) {
  const Shape in = x.shape();
  const Shape out = dy.shape();
  dx.resize(in);
  const std::ptrdiff_t in_row = static_cast<std::ptrdiff_t>(in.w) * in.c;
  const bool odd_edge = in.h % 2 != 0 || in.w % 2 != 0;
#pragma omp parallel for schedule(static)
  for (int n = 0; n < out.n; ++n) {
    if (odd_edge) std::fill_n(dx.image(n), in.image_size(), 0.0F);  // the dropped row and column
    for (int i = 0; i < out.h; ++i) {
      for (int j = 0; j < out.w; ++j) {
        const std::ptrdiff_t corner = 2 * i * in_row + static_cast<std::ptrdiff_t>(2 * j) * in.c;
        const std::ptrdiff_t pooled = (static_cast<std::ptrdiff_t>(i) * out.w + j) * out.c;
        const float* const top = x.image(n) + corner;
        const float* const bottom = top + in_row;
        const float* const largest = y.image(n) + pooled;
        const float* const gradient = dy.image(n) + pooled;
        float* const to_top = dx.image(n) + corner;
        float* const to_bottom = to_top + in_row;
#pragma omp simd
        for (int c = 0; c < in.c; ++c) {
          // The first of equal values takes it all.
          const float m = largest[c];
          float left = m <= bound ? 0.0F : gradient[c];
          const auto take = [&left, m](float value) {
            const float taken = value == m ? left : 0.0F;
            left = value == m ? 0.0F : left;
            return taken;
          };
          to_top[c] = take(top[c]);
          to_top[in.c + c] = take(top[in.c + c]);
          to_bottom[c] = take(bottom[c]);
          to_bottom[in.c + c] = take(bottom[in.c + c]);
        }
      }
    }
  }
}

}  // namespace sdmt::nn
