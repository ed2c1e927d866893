// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstddef>

#include "kernels/winograd.h"
#include "kernels/winograd_points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/winograd_weights.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_WINOGRAD_WEIGHTS_ONCE_
#define SDMT_NN_WINOGRAD_WEIGHTS_ONCE_
using TapMatrix = std::array<std::array<double, 3>, 10>;
constexpr int kMostColumns = 32;
/// The taps of one input channel for the columns of a panel.
using PanelTaps = std::array<std::array<std::array<float, kMostColumns>, 3>, 3>;
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

int PanelColumns() { return kColumns; }

/// G g G^T of a panel's taps g, in double and rounded after every operation, the same on every
/// instruction set: `rows` x `row_length` positions, `position` floats apart.
void TransformTaps(const PanelTaps& g, const TapMatrix& down, const TapMatrix& across,
                   std::size_t rows, std::size_t row_length, std::size_t position, float* to) {
  for (std::size_t row = 0; row < rows; ++row) {
    double half[3][kColumns];
    for (std::size_t v = 0; v < 3; ++v) {
      for (int column = 0; column < kColumns; ++column) {
        half[v][column] = down[row][0] * g[0][v][column] + down[row][1] * g[1][v][column] +
                          down[row][2] * g[2][v][column];
      }
    }
    for (std::size_t at = 0; at < row_length; ++at, to += position) {
      for (int column = 0; column < kColumns; ++column) {
        to[column] =
            static_cast<float>(across[at][0] * half[0][column] + across[at][1] * half[1][column] +
                               across[at][2] * half[2][column]);
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

HWY_EXPORT(PanelColumns);
HWY_EXPORT(TransformTaps);

namespace {

/// G: what takes three taps in a row to the points. Rows beyond kTile + 2 are not used.
template <int kTile>
constexpr TapMatrix tap_matrix() {
  TapMatrix g{};
  g[0][0] = kWinograd<kTile>.product[0];
  for (std::size_t i = 0; i < kTile / 2; ++i) {
    const double p = kWinograd<kTile>.point[i];
    const double scale = kWinograd<kTile>.scale[i];
    g[2 * i + 1] = {scale, p * scale, p * p * scale};
    g[2 * i + 2] = {scale, -p * scale, p * p * scale};
  }
  g[kTile + 1][2] = 1.0;
  return g;
}

const TapMatrix& tap_matrix(int tile) {
  static constexpr TapMatrix kTwo = tap_matrix<2>();
  static constexpr TapMatrix kFour = tap_matrix<4>();
  static constexpr TapMatrix kEight = tap_matrix<8>();
  return tile == 2 ? kTwo : tile == 4 ? kFour : kEight;
}

/// Fills values [position][panel][in][column] with G g G^T of the taps g whose first value for
/// output o and input i lies at taps(o, i), with `turned` in the reverse order; the next taps lie
/// `tap_step` floats further on, those of the next input `in_step`.
template <typename Taps>
void transform(int in, int out, WinogradTileSize tile, bool turned, std::ptrdiff_t tap_step,
               std::ptrdiff_t in_step, const Taps& taps, Tensor& values) {
  constexpr int kInputs = 16;  // a cache line of them is read at a time
  const int columns = HWY_DYNAMIC_DISPATCH(PanelColumns)();
  const int panels = (out + columns - 1) / columns;
  const int blocks = (in + kInputs - 1) / kInputs;
  values.resize({tile.positions(), panels, in, columns});
  const std::size_t position = values.shape().image_size();
  // nothing throws
#pragma omp parallel for collapse(2) schedule(static)
  for (int panel = 0; panel < panels; ++panel) {
    for (int block = 0; block < blocks; ++block) {
      const int first = block * kInputs;
      const int count = std::min(kInputs, in - first);
      std::array<PanelTaps, kInputs> g{};
      for (int column = 0; column < std::min(columns, out - panel * columns); ++column) {
        const float* const from = taps(panel * columns + column, first);
        for (int tap = 0; tap < 9; ++tap) {
          const int place = turned ? 8 - tap : tap;
          for (int i = 0; i < count; ++i) {
            g[i][place / 3][place % 3][column] = from[tap * tap_step + i * in_step];
          }
        }
      }
      for (int i = 0; i < count; ++i) {
        HWY_DYNAMIC_DISPATCH(TransformTaps)
        (g[i], tap_matrix(tile.height), tap_matrix(tile.width),
         static_cast<std::size_t>(tile.height) + 2, static_cast<std::size_t>(tile.width) + 2,
         position, values.data() + (std::ptrdiff_t{panel} * in + first + i) * columns);
      }
    }
  }
}

}  // namespace

void WinogradWeights::set(const Tensor& weight, WinogradTileSize tile) {
  const Shape shape = weight.shape();
  in_ = shape.c;
  out_ = shape.n;
  tile_ = tile;
  const std::ptrdiff_t step = in_;
  transform(
      in_, out_, tile_, false, step, 1,
      [&](int o, int i) { return weight.data() + o * 9 * step + i; }, values_);
}

void WinogradWeights::set_transposed(const Tensor& weight) {
  const Shape shape = weight.shape();
  in_ = shape.n;
  out_ = shape.c;
  tile_ = {};
  const std::ptrdiff_t step = out_;
  transform(
      in_, out_, tile_, true, step, 9 * step,
      [&](int o, int i) { return weight.data() + i * 9 * step + o; }, values_);
}

}  // namespace sdmt::nn
#endif
