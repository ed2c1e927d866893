// SPDX-License-Identifier: Apache-2.0
#include "convolution.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "kernels/column_sum.h"
#include "kernels/gemm.h"
#include "kernels/im2col.h"
#include "kernels/rgb_convolution.h"
#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {

namespace {

// Output pixels whose windows are laid out at a time.
constexpr std::int64_t kWindowsPerBlock = 256;

WindowGeometry geometry_of(const Conv2dOptions& options, Shape in, Shape out) {
  return {.height = in.h,
          .width = in.w,
          .channels = in.c,
          .kernel = options.kernel_size,
          .stride = options.stride,
          .padding = options.padding,
          .out_height = out.h,
          .out_width = out.w};
}

}  // namespace

Convolution::Convolution(const Conv2dOptions& options, const Tensor& weight, const Tensor& bias)
    : options_(options), weight_(weight), bias_(bias) {}

Convolution::Algorithm Convolution::algorithm() const {
  const bool padded = options_.kernel_size == 3 && options_.padding == 1;
  // With few input channels Winograd's transforms cost more than they save.
  if (padded && options_.stride == 1 && options_.in_channels >= 8) return Algorithm::winograd;
  if (padded && options_.in_channels == 3 &&
      has_rgb_convolution(options_.out_channels, options_.stride)) {
    return Algorithm::rgb;
  }
  return Algorithm::im2col;
}

Shape Convolution::output_shape(Shape in) const {
  const auto extent = [this](int size) {
    return (size + 2 * options_.padding - options_.kernel_size) / options_.stride + 1;
  };
  const int smallest = options_.kernel_size - 2 * options_.padding;
  if (in.c != options_.in_channels || in.h < std::max(1, smallest) ||
      in.w < std::max(1, smallest)) {
    throw std::invalid_argument(
        "Conv2d: input is " + in.str() + ", expected " + std::to_string(options_.in_channels) +
        " channels and an extent of at least " + std::to_string(std::max(1, smallest)));
  }
  return {in.n, extent(in.h), extent(in.w), options_.out_channels};
}

void Convolution::forward(const Tensor& x, ConvolutionEpilogue epilogue, Mode mode,
                          Tensor& y) const {
  if (weight_.empty()) throw std::logic_error("Conv2d: the weights were given up");
  const Shape out = output_shape(x.shape());
  if (epilogue.max_pool) MaxPool2d().output_shape(out);  // throws when there is nothing to pool
  epilogue.bias = bias();
  if (algorithm() == Algorithm::winograd) {
    winograd_convolution(x, winograd_weights(out, mode), epilogue, y);
  } else if (epilogue.max_pool) {
    Tensor before_pool;
    epilogue.max_pool = false;
    forward(x, epilogue, mode, before_pool);
    MaxPool2d().infer(before_pool, y);
  } else if (algorithm() == Algorithm::rgb) {
    rgb_convolution(x, {weight_, bias(), options_.stride}, epilogue.relu, y);
  } else {
    y.resize(out);
    forward_im2col(x, epilogue, y);
  }
}

bool Convolution::can_follow(const Convolution& first) const {
  return first.algorithm() == Algorithm::rgb && algorithm() == Algorithm::winograd &&
         first.options_.out_channels == options_.in_channels;
}

void Convolution::forward_after(const Convolution& first, const Tensor& x,
                                ConvolutionEpilogue epilogue, Tensor& y) const {
  const Shape out = output_shape(first.output_shape(x.shape()));
  if (epilogue.max_pool) MaxPool2d().output_shape(out);
  epilogue.bias = bias();
  const RgbRows rows(x, {first.weight_, first.bias(), first.options_.stride}, true);
  winograd_convolution(rows, winograd_weights(out, Mode::inference), epilogue, y);
}

const WinogradWeights& Convolution::winograd_weights(Shape out, Mode mode) const {
  // Training takes the tiles of 4x4: its weights change with every step, and larger ones make more
  // of them.
  const WinogradTileSize tile =
      mode == Mode::training ? WinogradTileSize() : fastest_winograd_tile(out.h, out.w);
  const std::scoped_lock lock(making_weights_);
  auto weights = std::find_if(winograd_weights_.begin(), winograd_weights_.end(),
                              [&](const WinogradWeights& made) { return made.tile() == tile; });
  if (weights == winograd_weights_.end()) weights = winograd_weights_.emplace(weights);
  if (weights->empty()) weights->set(weight_, tile);
  return *weights;
}

void Convolution::forward_im2col(const Tensor& x, const ConvolutionEpilogue& epilogue,
                                 Tensor& y) const {
  const Shape out = y.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t blocks = (g.windows() + kWindowsPerBlock - 1) / kWindowsPerBlock;
  io::FirstError error;
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (int image = 0; image < out.n; ++image) {
    for (std::int64_t block = 0; block < blocks; ++block) {
      error.guard([&] {
        const std::int64_t first = block * kWindowsPerBlock;
        const std::int64_t count = std::min(kWindowsPerBlock, g.windows() - first);
        float* const rows = thread_scratch(ScratchUse::columns, count * g.window_size());
        im2col(g, x.image(image), first, count, rows);
        gemm(count, out.c, g.window_size(), {rows, g.window_size(), 1},
             {weight_.data(), 1, g.window_size()},
             {.data = y.image(image) + first * out.c,
              .row_stride = out.c,
              .bias = epilogue.bias,
              .relu = epilogue.relu});
      });
    }
  }
  error.rethrow();
}

void Convolution::parameter_sums(const Tensor& x, const Tensor& dy, bool add, float* weight,
                                 float* bias) {
  if (weight != nullptr && algorithm() == Algorithm::winograd) {
    winograd_weight_gradient(x, dy, add, weight, bias);
  } else if (weight != nullptr && algorithm() == Algorithm::rgb) {
    rgb_weight_gradient(x, dy, options_.stride, add, weight, bias);
  } else {
    const std::int64_t pixels = static_cast<std::int64_t>(dy.size()) / dy.shape().c;
    if (bias != nullptr && !add) std::fill_n(bias, dy.shape().c, 0.0F);
    if (bias != nullptr) add_column_sums(dy.data(), pixels, dy.shape().c, bias);
    if (weight != nullptr) weight_gradient_im2col(x, dy, add, weight);
  }
}

void Convolution::add_gradient(bool of_weight, std::span<const float> sums, float* gradient) const {
  if (of_weight && algorithm() == Algorithm::winograd) {
    add_winograd_taps(sums.data(), weight_.shape(), gradient);
  } else {
    for (std::size_t i = 0; i < sums.size(); ++i) gradient[i] += sums[i];
  }
}

void Convolution::weight_gradient_im2col(const Tensor& x, const Tensor& dy, bool add,
                                         float* gradient) const {
  const auto values = static_cast<std::int64_t>(weight_.size());
  float* const sums = thread_scratch(ScratchUse::accumulators, weight_.size());
  const Shape out = dy.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t depth = g.window_size();
  float* const rows = thread_scratch(ScratchUse::columns, g.windows() * depth);
  for (int image = 0; image < out.n; ++image) {
    // nothing throws
#pragma omp parallel for schedule(static)
    for (int row = 0; row < g.out_height; ++row) {
      const std::int64_t first = std::int64_t{row} * g.out_width;
      im2col(g, x.image(image), first, g.out_width, rows + first * depth);
    }
    gemm(out.c, depth, g.windows(), {dy.image(image), 1, out.c}, {rows, depth, 1},
         {.data = sums, .row_stride = depth, .accumulate = image > 0});
  }
#pragma omp parallel for simd schedule(static)
  for (std::int64_t i = 0; i < values; ++i) gradient[i] = add ? gradient[i] + sums[i] : sums[i];
}

void Convolution::input_gradient(const Tensor& x, const Tensor& dy, const Tensor* mask,
                                 Tensor& dx) {
  if (algorithm() == Algorithm::winograd) {
    if (winograd_transposed_.empty()) winograd_transposed_.set_transposed(weight_);
    winograd_convolution(dy, winograd_transposed_, {.mask = mask}, dx);
  } else {
    input_gradient_im2col(x, dy, dx);
    if (mask != nullptr) ReLU().backward(x, *mask, dx, &dx);
  }
}

void Convolution::input_gradient_im2col(const Tensor& x, const Tensor& dy, Tensor& dx) const {
  const Shape out = dy.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t depth = g.window_size();
  dx.resize(x.shape());
  dx.fill(0.0F);
  const std::int64_t blocks = (g.windows() + kWindowsPerBlock - 1) / kWindowsPerBlock;
  io::FirstError error;
#pragma omp parallel for schedule(dynamic) if (out.n > 1)
  for (int image = 0; image < out.n; ++image) {
    error.guard([&] {
      for (std::int64_t block = 0; block < blocks; ++block) {
        const std::int64_t first = block * kWindowsPerBlock;
        const std::int64_t count = std::min(kWindowsPerBlock, g.windows() - first);
        float* const rows = thread_scratch(ScratchUse::columns, count * depth);
        gemm(count, depth, out.c, {dy.image(image) + first * out.c, out.c, 1},
             {weight_.data(), depth, 1}, {.data = rows, .row_stride = depth});
        col2im_add(g, rows, first, count, dx.image(image));
      }
    });
  }
  error.rethrow();
}

void Convolution::weights_changed() {
  for (WinogradWeights& weights : winograd_weights_) weights.clear();
  winograd_transposed_.clear();
}

}  // namespace sdmt::nn
