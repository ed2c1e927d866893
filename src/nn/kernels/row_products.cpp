// SPDX-License-Identifier: Apache-2.0
#include "kernels/row_products.h"

#include <algorithm>
#include <cstddef>

#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/row_products.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_ROW_PRODUCTS_ONCE_
#define SDMT_NN_ROW_PRODUCTS_ONCE_
/// Values summed in one vector register before its lanes are added up.
constexpr std::int64_t kStretch = 2048;
/// Rows of W that one thread works on at a time.
constexpr std::int64_t kRowsPerTask = 32;
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

// Rows of X and of W that are multiplied with each other in registers.
constexpr int kXRows = 3;
constexpr int kWRows = kLanes == 16 || HWY_ARCH_ARM ? 8 : 4;

/// Adds the products of kM rows of x with kN rows of w over k values to sums[i * sums_row + j].
template <int kM, int kN>
HWY_NOINLINE void DotTile(const float* x, std::ptrdiff_t x_row, const float* w,
                          std::ptrdiff_t w_row, std::int64_t k, float* sums,
                          std::ptrdiff_t sums_row) {
  const FloatTag d;
  FloatVec sum[kM][kN];
#pragma GCC unroll 8
  for (int i = 0; i < kM; ++i) {
#pragma GCC unroll 8
    for (int j = 0; j < kN; ++j) sum[i][j] = hn::Zero(d);
  }
  alignas(64) float x_end[kM][kLanes] = {};  // the last values, when they do not fill a vector
  alignas(64) float w_end[kN][kLanes] = {};
  const std::int64_t whole = k / kLanes * kLanes;
  for (std::int64_t at = 0; at < k; at += kLanes) {
    if (at == whole) {
      for (int i = 0; i < kM; ++i) std::copy_n(x + i * x_row + at, k - at, x_end[i]);
      for (int j = 0; j < kN; ++j) std::copy_n(w + j * w_row + at, k - at, w_end[j]);
      x = x_end[0] - at;
      w = w_end[0] - at;
      x_row = w_row = kLanes;
    }
    FloatVec xs[kM];
#pragma GCC unroll 8
    for (int i = 0; i < kM; ++i) xs[i] = hn::LoadU(d, x + i * x_row + at);
#pragma GCC unroll 8
    for (int j = 0; j < kN; ++j) {
      const FloatVec ws = hn::LoadU(d, w + j * w_row + at);
#pragma GCC unroll 8
      for (int i = 0; i < kM; ++i) sum[i][j] = hn::MulAdd(xs[i], ws, sum[i][j]);
    }
  }
#pragma GCC unroll 8
  for (int i = 0; i < kM; ++i) {
#pragma GCC unroll 8
    for (int j = 0; j < kN; ++j) {
      sums[i * sums_row + j] += hn::GetLane(hn::SumOfLanes(d, sum[i][j]));
    }
  }
}

/// Sets sums[i * sums_row + j] to the products of m rows of x and n <= kRowsPerTask rows of w.
void MultiplyRows(std::int64_t m, std::int64_t n, std::int64_t k, const float* x,
                  std::ptrdiff_t x_row, const float* w, std::ptrdiff_t w_row, float* sums,
                  std::ptrdiff_t sums_row) {
  for (std::int64_t i = 0; i < m; ++i) std::fill_n(sums + i * sums_row, n, 0.0F);
  float* const packed = thread_scratch(ScratchUse::packed_b, kRowsPerTask * kStretch);
  for (std::int64_t at = 0; at < k; at += kStretch) {
    const std::int64_t length = std::min(kStretch, k - at);
    const float* rows = w + at;
    std::ptrdiff_t row_step = w_row;
    if (m > kXRows) {
      // Rows a power of two apart push each other out of the caches; here they are used repeatedly.
      for (std::int64_t j = 0; j < n; ++j) {
        std::copy_n(rows + j * w_row, length, packed + j * kStretch);
      }
      rows = packed;
      row_step = kStretch;
    }
    for (std::int64_t i = 0; i < m;) {
      const bool several = m - i >= kXRows;
      const float* const x_at = x + i * x_row + at;
      float* const sums_at = sums + i * sums_row;
      std::int64_t j = 0;
      if (several) {
        for (; j + kWRows <= n; j += kWRows) {
          DotTile<kXRows, kWRows>(x_at, x_row, rows + j * row_step, row_step, length, sums_at + j,
                                  sums_row);
        }
        for (; j < n; ++j) {
          DotTile<kXRows, 1>(x_at, x_row, rows + j * row_step, row_step, length, sums_at + j,
                             sums_row);
        }
      } else {
        for (; j + 4 <= n; j += 4) {
          DotTile<1, 4>(x_at, x_row, rows + j * row_step, row_step, length, sums_at + j, sums_row);
        }
        for (; j < n; ++j) {
          DotTile<1, 1>(x_at, x_row, rows + j * row_step, row_step, length, sums_at + j, sums_row);
        }
      }
      i += several ? kXRows : 1;
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(MultiplyRows);

void multiply_rows(std::int64_t m, std::int64_t n, std::int64_t k, const float* x, const float* w,
                   ProductView c) {
  // Long sums are cut into parts that run in parallel and are added up in order.
  constexpr std::int64_t kPart = 4 * kStretch;
  const std::int64_t parts = (k + kPart - 1) / kPart;
  const std::int64_t row_blocks = (n + kRowsPerTask - 1) / kRowsPerTask;
  float* const sums = thread_scratch(ScratchUse::accumulators, parts * m * n);
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t task = 0; task < parts * row_blocks; ++task) {
    error.guard([&] {
      const std::int64_t part = task / row_blocks;
      const std::int64_t row = task % row_blocks * kRowsPerTask;
      HWY_DYNAMIC_DISPATCH(MultiplyRows)
      (m, std::min(kRowsPerTask, n - row), std::min(kPart, k - part * kPart), x + part * kPart, k,
       w + row * k + part * kPart, k, sums + part * m * n + row, n);
    });
  }
  error.rethrow();
  add_parts(m, n, sums, parts, n, c);
}

void add_parts(std::int64_t m, std::int64_t n, const float* sums, std::int64_t parts,
               std::ptrdiff_t sums_row, ProductView c) {
  // nothing throws
#pragma omp parallel for schedule(static)
  for (std::int64_t i = 0; i < m; ++i) {
    for (std::int64_t j = 0; j < n; ++j) {
      float value = c.accumulate ? c.data[i * c.row_stride + j] : 0.0F;
      for (std::int64_t part = 0; part < parts; ++part) {
        value += sums[(part * m + i) * sums_row + j];
      }
      if (c.bias != nullptr) value += c.bias[j];
      c.data[i * c.row_stride + j] = c.relu && value < 0.0F ? 0.0F : value;
    }
  }
}

}  // namespace sdmt::nn
#endif
