// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/conv2d.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "kernels/column_sum.h"
#include "kernels/gemm.h"
#include "kernels/im2col.h"
#include "kernels/rgb_convolution.h"
#include "kernels/scratch.h"
#include "kernels/winograd.h"
#include "parameter_access.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {

namespace {

// Output pixels whose windows are laid out at a time.
constexpr std::int64_t kWindowsPerBlock = 256;

void require_at_least(const char* field, int value, int bound) {
  if (value < bound) {
    throw std::invalid_argument(std::string("Conv2d: ") + field + " is " + std::to_string(value) +
                                ", expected >= " + std::to_string(bound));
  }
}

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

/// What follows a convolution whose result is `out`. Throws when `out` is too small to be pooled.
WinogradEpilogue epilogue_of(Fusion fusion, Shape out, const float* bias) {
  const bool pool = fusion == Fusion::relu_max_pool;
  if (pool) MaxPool2d().output_shape(out);
  return {.bias = bias, .relu = fusion != Fusion::none, .max_pool = pool};
}

}  // namespace

void Conv2dOptions::validate() const {
  require_at_least("in_channels", in_channels, 1);
  require_at_least("out_channels", out_channels, 1);
  require_at_least("kernel_size", kernel_size, 1);
  require_at_least("stride", stride, 1);
  require_at_least("padding", padding, 0);
}

Conv2d::Conv2d(Conv2dOptions options)
    : options_(options),
      winograd_small_(std::make_unique<WinogradWeights>()),
      winograd_large_(std::make_unique<WinogradWeights>()),
      winograd_transposed_(std::make_unique<WinogradWeights>()) {
  options_.validate();
  const int k = options_.kernel_size;
  weight_.name = "weight";
  weight_.value = Tensor({options_.out_channels, k, k, options_.in_channels});
  bias_.name = "bias";
  bias_.decay = false;
  if (options_.bias) bias_.value = Tensor({1, 1, 1, options_.out_channels});
}

Conv2d::~Conv2d() = default;

Conv2d::Algorithm Conv2d::algorithm() const {
  const bool same_size = options_.kernel_size == 3 && options_.stride == 1 && options_.padding == 1;
  // With few input channels Winograd's transforms cost more than they save.
  if (same_size && options_.in_channels >= 8) return Algorithm::winograd;
  if (same_size && options_.in_channels == 3 && has_rgb_convolution(options_.out_channels)) {
    return Algorithm::rgb;
  }
  return Algorithm::im2col;
}

void Conv2d::reset_parameters(Random& random) {
  he_normal(weight_.value, static_cast<double>(weight_.value.shape().image_size()), random);
  if (options_.bias) bias_.value.fill(0.0F);
  parameters_changed();
}

Shape Conv2d::output_shape(Shape in) const {
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

void Conv2d::forward(const Tensor& x, Tensor& y, Mode mode) {
  forward_fused(x, y, Fusion::none, mode);
}

void Conv2d::forward_fused(const Tensor& x, Tensor& y, Fusion fusion, Mode mode) {
  const Shape out = output_shape(x.shape());
  const WinogradEpilogue epilogue = epilogue_of(fusion, out, bias_data());
  if (algorithm() == Algorithm::winograd) {
    winograd_convolution(x, winograd_weights(out, mode), epilogue, y);
  } else if (epilogue.max_pool) {
    Tensor before_pool;
    forward_fused(x, before_pool, Fusion::relu, mode);
    MaxPool2d().forward(before_pool, y, Mode::inference);
  } else if (algorithm() == Algorithm::rgb) {
    rgb_convolution(x, weight_.value, epilogue.bias, epilogue.relu, y);
  } else {
    y.resize(out);
    forward_im2col(x, epilogue.bias, epilogue.relu, y);
  }
}

bool Conv2d::can_follow(const Conv2d& first) const {
  return first.algorithm() == Algorithm::rgb && algorithm() == Algorithm::winograd &&
         first.options_.out_channels == options_.in_channels;
}

void Conv2d::forward_after(Conv2d& first, const Tensor& x, Tensor& y, Fusion fusion) {
  const Shape out = output_shape(first.output_shape(x.shape()));
  const RgbRows rows(x, first.weight_.value, first.bias_data(), true);
  winograd_convolution(rows, winograd_weights(out, Mode::inference),
                       epilogue_of(fusion, out, bias_data()), y);
}

const WinogradWeights& Conv2d::winograd_weights(Shape out, Mode mode) {
  // Training takes the small tiles: its weights change with every step, and large tiles make more
  // of them.
  const WinogradTileSize tile =
      mode == Mode::training ? WinogradTileSize() : fastest_winograd_tile(out.h, out.w);
  WinogradWeights& weights = tile == WinogradTileSize() ? *winograd_small_ : *winograd_large_;
  if (weights.empty()) weights.set(weight_.value, tile);
  return weights;
}

void Conv2d::forward_im2col(const Tensor& x, const float* bias, bool relu, Tensor& y) {
  const Shape out = y.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t blocks = (g.windows() + kWindowsPerBlock - 1) / kWindowsPerBlock;
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (int image = 0; image < out.n; ++image) {
    for (std::int64_t block = 0; block < blocks; ++block) {
      const std::int64_t first = block * kWindowsPerBlock;
      const std::int64_t count = std::min(kWindowsPerBlock, g.windows() - first);
      float* const rows =
          thread_scratch(ScratchUse::columns, static_cast<std::size_t>(count * g.window_size()));
      im2col(g, x.image(image), first, count, rows);
      gemm(count, out.c, g.window_size(), {rows, g.window_size(), 1},
           {weight_.value.data(), 1, g.window_size()},
           {.data = y.image(image) + first * out.c,
            .row_stride = out.c,
            .bias = bias,
            .relu = relu});
    }
  }
}

void Conv2d::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  add_parameter_gradients(x, dy);
  if (dx == nullptr) return;
  if (algorithm() == Algorithm::winograd) {
    input_gradient_winograd(dy, nullptr, *dx);
  } else {
    input_gradient_im2col(x, dy, *dx);
  }
}

void Conv2d::backward_through_relu(const Tensor& x, const Tensor& dy, Tensor& dx) {
  add_parameter_gradients(x, dy);
  if (algorithm() == Algorithm::winograd) {
    input_gradient_winograd(dy, &x, dx);
  } else {
    input_gradient_im2col(x, dy, dx);
    ReLU().backward(x, x, dx, &dx);
  }
}

void Conv2d::add_parameter_gradients(const Tensor& x, const Tensor& dy) {
  float* const bias = options_.bias && bias_.trainable ? gradient_of(bias_) : nullptr;
  float* const weight = weight_.trainable ? gradient_of(weight_) : nullptr;
  if (weight != nullptr && algorithm() == Algorithm::winograd) {
    winograd_weight_gradient(x, dy, weight, bias);
  } else if (weight != nullptr && algorithm() == Algorithm::rgb) {
    rgb_weight_gradient(x, dy, weight, bias);
  } else {
    const std::int64_t pixels = static_cast<std::int64_t>(dy.size()) / dy.shape().c;
    if (bias != nullptr) add_column_sums(dy.data(), pixels, dy.shape().c, bias);
    if (weight != nullptr) weight_gradient_im2col(x, dy, weight);
  }
}

void Conv2d::weight_gradient_im2col(const Tensor& x, const Tensor& dy, float* gradient) {
  const Shape out = dy.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t depth = g.window_size();
  float* const rows =
      thread_scratch(ScratchUse::columns, static_cast<std::size_t>(g.windows() * depth));
  for (int image = 0; image < out.n; ++image) {
#pragma omp parallel for schedule(static)
    for (int row = 0; row < g.out_height; ++row) {
      const std::int64_t first = std::int64_t{row} * g.out_width;
      im2col(g, x.image(image), first, g.out_width, rows + first * depth);
    }
    gemm(out.c, depth, g.windows(), {dy.image(image), 1, out.c}, {rows, depth, 1},
         {.data = gradient, .row_stride = depth, .accumulate = true});
  }
}

void Conv2d::input_gradient_winograd(const Tensor& dy, const Tensor* mask, Tensor& dx) {
  if (winograd_transposed_->empty()) winograd_transposed_->set_transposed(weight_.value);
  winograd_convolution(dy, *winograd_transposed_, {.mask = mask}, dx);
}

void Conv2d::input_gradient_im2col(const Tensor& x, const Tensor& dy, Tensor& dx) {
  const Shape out = dy.shape();
  const WindowGeometry g = geometry_of(options_, x.shape(), out);
  const std::int64_t depth = g.window_size();
  dx.resize(x.shape());
  dx.fill(0.0F);
  const std::int64_t blocks = (g.windows() + kWindowsPerBlock - 1) / kWindowsPerBlock;
#pragma omp parallel for schedule(dynamic) if (out.n > 1)
  for (int image = 0; image < out.n; ++image) {
    for (std::int64_t block = 0; block < blocks; ++block) {
      const std::int64_t first = block * kWindowsPerBlock;
      const std::int64_t count = std::min(kWindowsPerBlock, g.windows() - first);
      float* const rows =
          thread_scratch(ScratchUse::columns, static_cast<std::size_t>(count * depth));
      gemm(count, depth, out.c, {dy.image(image) + first * out.c, out.c, 1},
           {weight_.value.data(), depth, 1}, {.data = rows, .row_stride = depth});
      col2im_add(g, rows, first, count, dx.image(image));
    }
  }
}

std::vector<Parameter*> Conv2d::parameters() {
  if (options_.bias) return {&weight_, &bias_};
  return {&weight_};
}

void Conv2d::parameters_changed() {
  winograd_small_->clear();
  winograd_large_->clear();
  winograd_transposed_->clear();
}

}  // namespace sdmt::nn
