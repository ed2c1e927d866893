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

/// Where a micro-tile reads and writes, and what it does on the way.
/// A comes in chunks of k: with r = kRowStride, element (i, k) stands at
/// a[(k / chunk) * a_chunk + i * r + (k % chunk) * a_step].
/// Vector j of row k of B, float or float16, stands at b[k * b_step + j * b_vector], vector j of
/// row i of C at c[i * c_row + j * c_vector].
template <typename B>
struct MicroTileOf {
  const float* a;
  std::ptrdiff_t a_chunk = 0;
  std::ptrdiff_t a_step = 1;
  std::int64_t chunk = kLanes;
  const B* b;
  std::ptrdiff_t b_step;
  std::ptrdiff_t b_vector;
  float* c;
  std::ptrdiff_t c_row;
  std::ptrdiff_t c_vector;
  std::int64_t k;
  bool accumulate = false;      ///< add to C
  const float* bias = nullptr;  ///< kColumns values added to every row
  bool relu = false;            ///< negative results become 0
};
using MicroTile = MicroTileOf<float>;

using HalfTag = hn::Rebind<hwy::float16_t, FloatTag>;

HWY_INLINE FloatVec LoadFloats(const float* p) { return hn::LoadU(FloatTag(), p); }
HWY_INLINE FloatVec LoadFloats(const hwy::float16_t* p) {
  return hn::PromoteTo(FloatTag(), hn::LoadU(HalfTag(), p));
}

/// The first `count` values at p; zeros in the other lanes.
HWY_INLINE FloatVec LoadSome(const float* p, std::int64_t count) {
  const FloatTag d;
  if (count >= kLanes) return hn::LoadU(d, p);
  alignas(64) float lanes[kLanes] = {};
  for (std::int64_t i = 0; i < count; ++i) lanes[i] = p[i];
  return hn::Load(d, lanes);
}

HWY_INLINE void StoreSome(FloatVec v, float* p, std::int64_t count) {
  const FloatTag d;
  if (count >= kLanes) {
    hn::StoreU(v, d, p);
    return;
  }
  alignas(64) float lanes[kLanes];
  hn::Store(v, d, lanes);
  for (std::int64_t i = 0; i < count; ++i) p[i] = lanes[i];
}

/// max(v, 0) that keeps NaN.
HWY_INLINE FloatVec Rectify(FloatVec v) { return hn::Max(hn::Zero(FloatTag()), v); }

template <int kRows, int kRowStride, typename B>
HWY_NOINLINE void RunMicroTile(const MicroTileOf<B>& tile) {
  const FloatTag d;
  FloatVec sum[kRows][2];
#pragma GCC unroll 16
  for (int i = 0; i < kRows; ++i) {
    sum[i][0] = hn::Zero(d);
    sum[i][1] = hn::Zero(d);
  }
  const B* HWY_RESTRICT b0 = tile.b;
  const B* HWY_RESTRICT b1 = tile.b + tile.b_vector;
  const std::ptrdiff_t b_step = tile.b_step;
  const std::ptrdiff_t a_step = tile.a_step;
  const float* chunk = tile.a;
  for (std::int64_t left = tile.k; left > 0; left -= tile.chunk, chunk += tile.a_chunk) {
    const float* HWY_RESTRICT a = chunk;
    for (std::int64_t steps = std::min(left, tile.chunk); steps > 0;
         --steps, a += a_step, b0 += b_step, b1 += b_step) {
      const FloatVec vb0 = LoadFloats(b0);
      const FloatVec vb1 = LoadFloats(b1);
#pragma GCC unroll 16
      for (int i = 0; i < kRows; ++i) {
        const FloatVec va = hn::Set(d, a[i * kRowStride]);
        sum[i][0] = hn::MulAdd(va, vb0, sum[i][0]);
        sum[i][1] = hn::MulAdd(va, vb1, sum[i][1]);
      }
    }
  }
  const std::ptrdiff_t c_row = tile.c_row;
  float* HWY_RESTRICT c0 = tile.c;
  float* HWY_RESTRICT c1 = tile.c + tile.c_vector;
  if (tile.accumulate) {
#pragma GCC unroll 16
    for (int i = 0; i < kRows; ++i) {
      sum[i][0] = hn::Add(sum[i][0], hn::LoadU(d, c0 + i * c_row));
      sum[i][1] = hn::Add(sum[i][1], hn::LoadU(d, c1 + i * c_row));
    }
  }
  if (tile.bias != nullptr) {
    const FloatVec bias0 = hn::LoadU(d, tile.bias);
    const FloatVec bias1 = hn::LoadU(d, tile.bias + kLanes);
#pragma GCC unroll 16
    for (int i = 0; i < kRows; ++i) {
      sum[i][0] = hn::Add(sum[i][0], bias0);
      sum[i][1] = hn::Add(sum[i][1], bias1);
    }
  }
  if (tile.relu) {
#pragma GCC unroll 16
    for (int i = 0; i < kRows; ++i) {
      sum[i][0] = Rectify(sum[i][0]);
      sum[i][1] = Rectify(sum[i][1]);
    }
  }
#pragma GCC unroll 16
  for (int i = 0; i < kRows; ++i, c0 += c_row, c1 += c_row) {
    hn::StoreU(sum[i][0], d, c0);
    hn::StoreU(sum[i][1], d, c1);
  }
}

/// A micro-tile of 1 to kMaxRows rows.
template <int kRowStride = kLanes, int kRows = kMaxRows, typename B>
HWY_INLINE void RunMicroTile(int rows, const MicroTileOf<B>& tile) {
  if (rows == kRows) {
    RunMicroTile<kRows, kRowStride>(tile);
  } else if constexpr (kRows > 1) {
    RunMicroTile<kRowStride, kRows - 1>(rows, tile);
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
