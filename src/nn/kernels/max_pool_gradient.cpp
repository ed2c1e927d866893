// SPDX-License-Identifier: Apache-2.0
#include "kernels/max_pool_gradient.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/max_pool_gradient.cpp"
#include <hwy/foreach_target.h>
// Highway's order: highway.h comes after foreach_target.h.
#include <hwy/highway.h>

namespace sdmt::nn {
#ifndef SDMT_NN_MAX_POOL_GRADIENT_ONCE_
#define SDMT_NN_MAX_POOL_GRADIENT_ONCE_
/// A row of windows.
struct PoolRow {
  const float* x;  // two rows of pixels
  const float* y;
  const float* dy;
  float* dx;  // as x
  std::ptrdiff_t next_row;
  int windows;
  int channels;
  float bound;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
HWY_INLINE void RouteWindow(D d, const PoolRow& row, const float* x, const float* y,
                            const float* dy, float* dx) {
  const auto largest = hn::LoadU(d, y);
  auto left = hn::IfThenZeroElse(hn::Le(largest, hn::Set(d, row.bound)), hn::LoadU(d, dy));
  const std::ptrdiff_t offsets[4] = {0, row.channels, row.next_row, row.next_row + row.channels};
#pragma GCC unroll 4
  for (int i = 0; i < 4; ++i) {
    const auto takes = hn::Eq(hn::LoadU(d, x + offsets[i]), largest);
    hn::StoreU(hn::IfThenElseZero(takes, left), d, dx + offsets[i]);
    left = hn::IfThenZeroElse(takes, left);
  }
}

void RoutePoolRow(const PoolRow& row) {
  const hn::ScalableTag<float> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int window = 0; window < row.windows; ++window) {
    const std::ptrdiff_t in = std::ptrdiff_t{window} * 2 * row.channels;
    const std::ptrdiff_t out = std::ptrdiff_t{window} * row.channels;
    int c = 0;
    for (; c + lanes <= row.channels; c += lanes) {
      RouteWindow(d, row, row.x + in + c, row.y + out + c, row.dy + out + c, row.dx + in + c);
    }
    for (; c < row.channels; ++c) {
      RouteWindow(hn::CappedTag<float, 1>(), row, row.x + in + c, row.y + out + c, row.dy + out + c,
                  row.dx + in + c);
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(RoutePoolRow);

void max_pool_gradient(const Tensor& x, const Tensor& y, const Tensor& dy, float bound,
                       Tensor& dx) {
  const Shape in = x.shape();
  const Shape out = dy.shape();
  dx.resize(in);
  const std::ptrdiff_t in_row = std::ptrdiff_t{in.w} * in.c;
  const std::ptrdiff_t out_row = std::ptrdiff_t{out.w} * out.c;
  const bool odd_edge = in.h % 2 != 0 || in.w % 2 != 0;
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int n = 0; n < out.n; ++n) {
    if (odd_edge) std::fill_n(dx.image(n), in.image_size(), 0.0F);  // the dropped row and column
    for (int i = 0; i < out.h; ++i) {
      HWY_DYNAMIC_DISPATCH(RoutePoolRow)
      ({.x = x.image(n) + 2 * i * in_row,
        .y = y.image(n) + i * out_row,
        .dy = dy.image(n) + i * out_row,
        .dx = dx.image(n) + 2 * i * in_row,
        .next_row = in_row,
        .windows = out.w,
        .channels = in.c,
        .bound = bound});
    }
  }
}

}  // namespace sdmt::nn
#endif
