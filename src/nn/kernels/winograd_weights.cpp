// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <numbers>

#include "kernels/winograd.h"

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

/// G g for three taps in a row, at the points 0, +-sqrt(1/2), +-sqrt(2) and infinity.
inline void spread_taps(const double (&g)[3], double (&u)[6]) {
  constexpr double kRoot = std::numbers::sqrt2;
  const double inner_even = g[0] + g[2] / 2;
  const double outer_even = g[0] + g[2] * 2;
  u[0] = g[0];
  u[1] = (inner_even + g[1] * kRoot / 2) / -1.5;
  u[2] = (inner_even - g[1] * kRoot / 2) / -1.5;
  u[3] = (outer_even + g[1] * kRoot) / 6;
  u[4] = (outer_even - g[1] * kRoot) / 6;
  u[5] = g[2];
}

/// G g G^T of the taps g[3][3].
void transform_taps(const double (&g)[3][3], double (&u)[6][6]) {
  double half[6][3];
  for (int v = 0; v < 3; ++v) {
    const double column[3] = {g[0][v], g[1][v], g[2][v]};
    double spread[6];
    spread_taps(column, spread);
    for (int i = 0; i < 6; ++i) half[i][v] = spread[i];
  }
  for (int i = 0; i < 6; ++i) spread_taps(half[i], u[i]);
}

/// Fills values [36][panel][in][column] from the taps that `tap(o, i, u, v)` gives.
template <typename Tap>
void transform(int in, int out, const Tap& tap, Tensor& values) {
  const int columns = HWY_DYNAMIC_DISPATCH(PanelColumns)();
  const int panels = (out + columns - 1) / columns;
  values.resize({36, panels, in, columns});
  const std::ptrdiff_t position = static_cast<std::ptrdiff_t>(panels) * in * columns;
#pragma omp parallel for collapse(2) schedule(static)
  for (int panel = 0; panel < panels; ++panel) {
    for (int i = 0; i < in; ++i) {
      float* const to = values.data() + (static_cast<std::ptrdiff_t>(panel) * in + i) * columns;
      for (int column = 0; column < columns; ++column) {
        const int o = panel * columns + column;
        double u[6][6] = {};
        if (o < out) {
          double g[3][3];
          for (int a = 0; a < 3; ++a) {
            for (int b = 0; b < 3; ++b) g[a][b] = tap(o, i, a, b);
          }
          transform_taps(g, u);
        }
        for (int p = 0; p < 36; ++p)
          to[p * position + column] = static_cast<float>(u[p / 6][p % 6]);
      }
    }
  }
}

}  // namespace

void WinogradWeights::set(const Tensor& weight) {
  const Shape shape = weight.shape();
  in_ = shape.c;
  out_ = shape.n;
  const float* const w = weight.data();
  transform(
      in_, out_,
      [w, in = static_cast<std::ptrdiff_t>(in_)](int o, int i, int a, int b) {
        return w[(o * 9 + a * 3 + b) * in + i];
      },
      values_);
}

void WinogradWeights::set_transposed(const Tensor& weight) {
  const Shape shape = weight.shape();
  in_ = shape.n;
  out_ = shape.c;
  const float* const w = weight.data();
  transform(
      in_, out_,
      [w, channels = static_cast<std::ptrdiff_t>(out_)](int o, int i, int a, int b) {
        return w[(i * 9 + (2 - a) * 3 + (2 - b)) * channels + o];
      },
      values_);
}

}  // namespace sdmt::nn
#endif
