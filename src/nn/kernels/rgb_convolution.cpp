// SPDX-License-Identifier: Apache-2.0
#include "kernels/rgb_convolution.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/rgb_convolution.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_RGB_CONVOLUTION_ONCE_
#define SDMT_NN_RGB_CONVOLUTION_ONCE_
constexpr int kRgb = 3;
constexpr int kRowTaps = 3 * kRgb;  // values of one row of a window
constexpr int kTaps = 3 * kRowTaps;
/// Pixels of a row or column of the result.
constexpr int result_extent(int in, int stride) { return (in - 1) / stride + 1; }
constexpr int kBandRows = 8;  // output rows that a thread works on at a time
/// Sums of a weight gradient for one image: [27][out] and [out] for the bias.
constexpr std::size_t gradient_values(int out) {
  return static_cast<std::size_t>(kTaps + 1) * static_cast<std::size_t>(out);
}
struct RgbTask {
  const Tensor& x;
  const float* packed;
  const float* bias;
  int out;
  int stride;
  bool relu;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

bool FillsPanels(int out_channels) { return out_channels % kColumns == 0; }

/// The rows of an image that rows [top, top + rows) of the result need, with a pixel of zeros on
/// either side: the first is row top * stride - 1.
const float* PadBand(const Tensor& x, int stride, int image, int top, int rows) {
  const Shape shape = x.shape();
  const std::size_t width = static_cast<std::size_t>(shape.w) * kRgb;
  const std::size_t padded_width = width + 2 * kRgb;
  const int first = top * stride - 1;
  const int padded_rows = (rows - 1) * stride + 3;
  float* const band = thread_scratch(ScratchUse::padded, padded_rows * padded_width);
  std::fill_n(band, padded_rows * padded_width, 0.0F);
  for (int row = std::max(0, first); row < std::min(shape.h, first + padded_rows); ++row) {
    std::copy_n(x.image(image) + row * width, width, band + (row - first) * padded_width + kRgb);
  }
  return band;
}

/// packed: [panel][27][kColumns].
void PackRgbWeights(const Tensor& weight, float* packed) {
  const int out = weight.shape().n;
  for (int o = 0; o < out; ++o) {
    float* const to = packed + o / kColumns * kColumns * kTaps + o % kColumns;
    for (int tap = 0; tap < kTaps; ++tap) to[tap * kColumns] = weight.data()[o * kTaps + tap];
  }
}

/// Rows [top, top + rows) of an image's result, to y [rows,w,out].
template <int kStride>
void ConvolveRgbBandOf(const RgbTask& task, int image, int top, int rows, float* y) {
  const Shape shape{1, rows, result_extent(task.x.shape().w, kStride), task.out};
  const std::ptrdiff_t padded_width = std::ptrdiff_t{task.x.shape().w + 2} * kRgb;
  const float* const band = PadBand(task.x, kStride, image, top, rows);
  const int pixels = EvenRows(shape.w);
  for (int row = 0; row < rows; ++row) {
    for (int left = 0; left < shape.w; left += pixels) {
      float* const to = y + (std::ptrdiff_t{row} * shape.w + left) * shape.c;
      for (int column = 0; column < shape.c; column += kColumns) {
        RunMicroTile<kRgb * kStride>(
            std::min(pixels, shape.w - left),
            MicroTile{.a = band + (row * padded_width + left * kRgb) * kStride,
                      .a_chunk = padded_width,
                      .chunk = kRowTaps,
                      .b = task.packed + std::ptrdiff_t{column} * kTaps,
                      .b_step = kColumns,
                      .b_vector = kLanes,
                      .c = to + column,
                      .c_row = shape.c,
                      .c_vector = kLanes,
                      .k = kTaps,
                      .bias = task.bias == nullptr ? nullptr : task.bias + column,
                      .relu = task.relu});
      }
    }
  }
}

void ConvolveRgbBand(const RgbTask& task, int image, int top, int rows, float* y) {
  if (task.stride == 1) {
    ConvolveRgbBandOf<1>(task, image, top, rows, y);
  } else {
    ConvolveRgbBandOf<2>(task, image, top, rows, y);
  }
}

/// sums [28][out]: 27 taps, then the bias, of one image.
void RgbImageGradient(const Tensor& x, const Tensor& dy, int stride, int image, float* sums) {
  const Shape shape = dy.shape();
  const std::ptrdiff_t padded_width = std::ptrdiff_t{x.shape().w + 2} * kRgb;
  const float one = 1.0F;
  std::fill_n(sums, gradient_values(shape.c), 0.0F);
  for (int top = 0; top < shape.h; top += kBandRows) {
    const int rows = std::min(kBandRows, shape.h - top);
    const float* const band = PadBand(x, stride, image, top, rows);
    for (int row = 0; row < rows; ++row) {
      const float* const from = dy.image(image) + std::ptrdiff_t{top + row} * shape.w * shape.c;
      for (int column = 0; column < shape.c; column += kColumns) {
        MicroTile tile{.a = &one,
                       .a_step = 0,
                       .chunk = shape.w,
                       .b = from + column,
                       .b_step = shape.c,
                       .b_vector = kLanes,
                       .c = sums + std::ptrdiff_t{kTaps} * shape.c + column,
                       .c_row = shape.c,
                       .c_vector = kLanes,
                       .k = shape.w,
                       .accumulate = true};
        RunMicroTile<1, 1>(tile);
        tile.a_step = std::ptrdiff_t{stride} * kRgb;
        for (int tap = 0; tap < kTaps; tap += kRgb) {
          tile.a = band + (row * stride + tap / kRowTaps) * padded_width + tap % kRowTaps;
          tile.c = sums + std::ptrdiff_t{tap} * shape.c + column;
          RunMicroTile<kRgb, 1>(tile);
        }
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(FillsPanels);
HWY_EXPORT(PackRgbWeights);
HWY_EXPORT(ConvolveRgbBand);
HWY_EXPORT(RgbImageGradient);

bool has_rgb_convolution(int out_channels, int stride) {
  return stride <= 2 && HWY_DYNAMIC_DISPATCH(FillsPanels)(out_channels);
}

void rgb_convolution(const Tensor& x, const RgbWeights& weights, bool relu, Tensor& y) {
  const RgbRows rows(x, weights, relu);
  y.resize(rows.shape());
  const std::ptrdiff_t row_values = std::ptrdiff_t{y.shape().w} * y.shape().c;
  io::FirstError error;
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (int image = 0; image < y.shape().n; ++image) {
    for (int top = 0; top < y.shape().h; top += kBandRows) {
      error.guard([&] {
        rows.compute(image, top, std::min(kBandRows, y.shape().h - top),
                     y.image(image) + top * row_values);
      });
    }
  }
  error.rethrow();
}

RgbRows::RgbRows(const Tensor& x, const RgbWeights& weights, bool relu)
    : x_(x), weights_(weights), relu_(relu) {
  float* const packed = thread_scratch(ScratchUse::packed_b, weights.weight.size());
  HWY_DYNAMIC_DISPATCH(PackRgbWeights)(weights.weight, packed);
  packed_ = packed;
}

Shape RgbRows::shape() const {
  const Shape in = x_.shape();
  return {in.n, result_extent(in.h, weights_.stride), result_extent(in.w, weights_.stride),
          weights_.weight.shape().n};
}

void RgbRows::compute(int image, int top, int rows, float* to) const {
  HWY_DYNAMIC_DISPATCH(ConvolveRgbBand)
  ({x_, packed_, weights_.bias, weights_.weight.shape().n, weights_.stride, relu_}, image, top,
   rows, to);
}

void rgb_weight_gradient(const Tensor& x, const Tensor& dy, int stride, bool add,
                         float* weight_gradient, float* bias_gradient) {
  const Shape shape = dy.shape();
  const std::size_t values = gradient_values(shape.c);
  float* const sums = thread_scratch(ScratchUse::accumulators, values * shape.n);
  // nothing throws
#pragma omp parallel for schedule(dynamic)
  for (int image = 0; image < shape.n; ++image) {
    HWY_DYNAMIC_DISPATCH(RgbImageGradient)
    (x, dy, stride, image, sums + image * values);
  }
  std::vector<double> total(values, 0.0);
  for (int image = 0; image < shape.n; ++image) {
    const float* const from = sums + image * values;
    for (std::size_t i = 0; i < values; ++i) total[i] += from[i];
  }
  for (int o = 0; o < shape.c; ++o) {
    const auto finish = [&](int row, float& gradient) {
      const int index = row * shape.c + o;
      const auto value = static_cast<float>(total[index]);
      gradient = add ? gradient + value : value;
    };
    for (int tap = 0; tap < kTaps; ++tap) finish(tap, weight_gradient[o * kTaps + tap]);
    if (bias_gradient != nullptr) finish(kTaps, bias_gradient[o]);
  }
}

}  // namespace sdmt::nn
#endif
