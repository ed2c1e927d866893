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

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

int PanelColumns() { return kColumns; }

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(PanelColumns);

namespace {

using TapMatrix = std::array<std::array<double, 3>, 10>;

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

constexpr int kMostColumns = 32;
using Columns = std::array<double, kMostColumns>;

/// Fills values [position][panel][in][column] with G g G^T of the taps g that `tap(o, i, u, v)`
/// gives.
template <typename Tap>
void transform(int in, int out, WinogradTileSize tile, const Tap& tap, Tensor& values) {
  const int columns = HWY_DYNAMIC_DISPATCH(PanelColumns)();
  const int panels = (out + columns - 1) / columns;
  const auto rows = static_cast<std::size_t>(tile.height) + 2;
  const auto row_length = static_cast<std::size_t>(tile.width) + 2;
  const TapMatrix& down = tap_matrix(tile.height);
  const TapMatrix& across = tap_matrix(tile.width);
  values.resize({tile.positions(), panels, in, columns});
  const std::size_t position = values.shape().image_size();
  // nothing throws
#pragma omp parallel for collapse(2) schedule(static)
  for (int panel = 0; panel < panels; ++panel) {
    for (int i = 0; i < in; ++i) {
      std::array<std::array<Columns, 3>, 3> g{};
      for (int column = 0; column < std::min(columns, out - panel * columns); ++column) {
        for (int tap_index = 0; tap_index < 9; ++tap_index) {
          const int u = tap_index / 3;
          const int v = tap_index % 3;
          g[u][v][column] = tap(panel * columns + column, i, u, v);
        }
      }
      float* to = values.data() + (std::ptrdiff_t{panel} * in + i) * columns;
      for (std::size_t row = 0; row < rows; ++row) {
        std::array<Columns, 3> half;
        for (std::size_t v = 0; v < 3; ++v) {
          for (int column = 0; column < columns; ++column) {
            half[v][column] = down[row][0] * g[0][v][column] + down[row][1] * g[1][v][column] +
                              down[row][2] * g[2][v][column];
          }
        }
        for (std::size_t at = 0; at < row_length; ++at, to += position) {
          for (int column = 0; column < columns; ++column) {
            to[column] = static_cast<float>(across[at][0] * half[0][column] +
                                            across[at][1] * half[1][column] +
                                            across[at][2] * half[2][column]);
          }
        }
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
  const float* const w = weight.data();
  transform(
      in_, out_, tile_,
      [w, in = static_cast<std::ptrdiff_t>(in_)](int o, int i, int a, int b) {
        return w[(o * 9 + a * 3 + b) * in + i];
      },
      values_);
}

void WinogradWeights::set_transposed(const Tensor& weight) {
  const Shape shape = weight.shape();
  in_ = shape.n;
  out_ = shape.c;
  tile_ = {};
  const float* const w = weight.data();
  transform(
      in_, out_, tile_,
      [w, channels = static_cast<std::ptrdiff_t>(out_)](int o, int i, int a, int b) {
        return w[(i * 9 + (2 - a) * 3 + (2 - b)) * channels + o];
      },
      values_);
}

}  // namespace sdmt::nn
#endif
