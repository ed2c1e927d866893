// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/avg_pool2d.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace sdmt::nn {

void AvgPool2dOptions::validate() const {
  if (kernel_height < 1 || kernel_width < 1) {
    throw std::invalid_argument("AvgPool2d: kernel is " + std::to_string(kernel_height) + "x" +
                                std::to_string(kernel_width) + ", expected at least 1x1");
  }
}

AvgPool2d::AvgPool2d(AvgPool2dOptions options) : options_(options) { options_.validate(); }

Shape AvgPool2d::output_shape(Shape in) const {
  if (in.h % options_.kernel_height != 0 || in.w % options_.kernel_width != 0) {
    throw std::invalid_argument("AvgPool2d: input " + in.str() + " is not filled by blocks of " +
                                std::to_string(options_.kernel_height) + "x" +
                                std::to_string(options_.kernel_width));
  }
  return {in.n, in.h / options_.kernel_height, in.w / options_.kernel_width, in.c};
}

void AvgPool2d::infer(const Tensor& x, Tensor& y) const {
  const Shape in = x.shape();
  const Shape out = output_shape(in);
  y.resize(out);
  const int kh = options_.kernel_height, kw = options_.kernel_width;
  const auto channels = static_cast<std::ptrdiff_t>(in.c);
  const float scale = 1.0F / static_cast<float>(kh * kw);
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int row = 0; row < out.n * out.h; ++row) {
    const int n = row / out.h, by = row % out.h;
    for (int bx = 0; bx < out.w; ++bx) {
      float* to = y.image(n) + (by * out.w + bx) * channels;
      std::fill_n(to, channels, 0.0F);
      for (int i = 0; i < kh * kw; ++i) {
        const int pixel = (by * kh + i / kw) * in.w + bx * kw + i % kw;
        const float* from = x.image(n) + pixel * channels;
        for (std::ptrdiff_t c = 0; c < channels; ++c) to[c] += from[c];
      }
      for (std::ptrdiff_t c = 0; c < channels; ++c) to[c] *= scale;
    }
  }
}

void AvgPool2d::backward(const Tensor& x, const Tensor& /*y*/, const Tensor& dy, Tensor* dx) {
  if (dx == nullptr) return;
  const Shape in = x.shape();
  const Shape out = dy.shape();
  dx->resize(in);
  const int kh = options_.kernel_height, kw = options_.kernel_width;
  const auto channels = static_cast<std::ptrdiff_t>(in.c);
  const float scale = 1.0F / static_cast<float>(kh * kw);
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int row = 0; row < in.n * in.h; ++row) {
    const int n = row / in.h, y_in = row % in.h;
    for (int x_in = 0; x_in < in.w; ++x_in) {
      const int block = y_in / kh * out.w + x_in / kw;
      const float* from = dy.image(n) + block * channels;
      float* to = dx->image(n) + (y_in * in.w + x_in) * channels;
      for (std::ptrdiff_t c = 0; c < channels; ++c) to[c] = scale * from[c];
    }
  }
}

}  // namespace sdmt::nn
