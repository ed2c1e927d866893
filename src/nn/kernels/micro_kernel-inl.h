// SPDX-License-Identifier: Apache-2.0
// The register-blocked heart of every matrix product, compiled once for each SIMD target. Include
// only from files that Highway's foreach_target.h compiles repeatedly.
#if defined(SDMT_NN_MICRO_KERNEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SDMT_NN_MICRO_KERNEL_INL_H_
#undef SDMT_NN_MICRO_KERNEL_INL_H_
#else
#define SDMT_NN_MICRO_KERNEL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using FloatVec = hn::Vec<FloatTag>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(FloatTag()));
constexpr int kColumns = 2 * kLanes;  // a micro-tile is two vectors wide
// Rows of a micro-tile: as many as leave registers for two vectors of B and a broadcast value of A.
constexpr int kMaxRows = kLanes == 16 ? 14 : (HWY_ARCH_ARM ? 12 : 6);

/// Where a micro-tile reads and writes. A is stored in chunks of kLanes consecutive k: element
/// (i, k) at a[(k / kLanes) * a_chunk + i * kLanes + k % kLanes]; vector j of row k of B at
/// b[k * b_step + j * b_vector]; vector j of row i of C at c[i * c_row + j * c_vector].
struct MicroTile {
  const float* a;
  std::ptrdiff_t a_chunk;
  const float* b;
  std::ptrdiff_t b_step;
  std::ptrdiff_t b_vector;
  float* c;
  std::ptrdiff_t c_row;
  std::ptrdiff_t c_vector;
  std::int64_t k;
  bool accumulate;
};

template <int kRows>
HWY_NOINLINE void RunMicroTile(const MicroTile& tile) {
  const FloatTag d;
  FloatVec sum[kRows][2];
#pragma GCC unroll 16
  for (int i = 0; i < kRows; ++i) {
    sum[i][0] = hn::Zero(d);
    sum[i][1] = hn::Zero(d);
  }
  const float* HWY_RESTRICT b0 = tile.b;
  const float* HWY_RESTRICT b1 = tile.b + tile.b_vector;
  const std::ptrdiff_t b_step = tile.b_step;
  const float* chunk = tile.a;
  for (std::int64_t left = tile.k; left > 0; left -= kLanes, chunk += tile.a_chunk) {
    const float* HWY_RESTRICT a = chunk;
    const float* const end = a + std::min<std::int64_t>(left, kLanes);
    for (; a != end; ++a, b0 += b_step, b1 += b_step) {
      const FloatVec vb0 = hn::LoadU(d, b0);
      const FloatVec vb1 = hn::LoadU(d, b1);
#pragma GCC unroll 16
      for (int i = 0; i < kRows; ++i) {
        const FloatVec va = hn::Set(d, a[i * kLanes]);
        sum[i][0] = hn::MulAdd(va, vb0, sum[i][0]);
        sum[i][1] = hn::MulAdd(va, vb1, sum[i][1]);
      }
    }
  }
  float* HWY_RESTRICT c0 = tile.c;
  float* HWY_RESTRICT c1 = tile.c + tile.c_vector;
#pragma GCC unroll 16
  for (int i = 0; i < kRows; ++i, c0 += tile.c_row, c1 += tile.c_row) {
    if (tile.accumulate) {
      sum[i][0] = hn::Add(sum[i][0], hn::LoadU(d, c0));
      sum[i][1] = hn::Add(sum[i][1], hn::LoadU(d, c1));
    }
    hn::StoreU(sum[i][0], d, c0);
    hn::StoreU(sum[i][1], d, c1);
  }
}

template <int kRows = kMaxRows>
HWY_INLINE void RunMicroTile(int rows, const MicroTile& tile) {
  if (rows == kRows) {
    RunMicroTile<kRows>(tile);
  } else if constexpr (kRows > 1) {
    RunMicroTile<kRows - 1>(rows, tile);
  }
}

/// Rows of each micro-tile when `rows` rows are shared out as evenly as possible.
HWY_INLINE int EvenRows(std::int64_t rows) {
  const std::int64_t tiles = (rows + kMaxRows - 1) / kMaxRows;
  return static_cast<int>((rows + tiles - 1) / tiles);
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#endif
