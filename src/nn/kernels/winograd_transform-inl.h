// SPDX-License-Identifier: Apache-2.0
// The tile transforms of winograd.h over vectors of channels. Included like micro_kernel-inl.h.
#if defined(SDMT_NN_WINOGRAD_TRANSFORM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#undef SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#else
#define SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#endif

#include "kernels/micro_kernel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

constexpr int kTile = 4;        // rows and columns of an output tile
constexpr int kWindow = 6;      // of an input tile
constexpr int kPositions = 36;  // of the transformed tile

/// The first `count` values at p; zeros in the other lanes.
HWY_INLINE FloatVec LoadSome(const float* p, int count) {
  const FloatTag d;
  if (count >= kLanes) return hn::LoadU(d, p);
  alignas(64) float lanes[kLanes] = {};
  for (int i = 0; i < count; ++i) lanes[i] = p[i];
  return hn::Load(d, lanes);
}

HWY_INLINE void StoreSome(FloatVec v, float* p, int count) {
  const FloatTag d;
  if (count >= kLanes) {
    hn::StoreU(v, d, p);
    return;
  }
  alignas(64) float lanes[kLanes];
  hn::Store(v, d, lanes);
  for (int i = 0; i < count; ++i) p[i] = lanes[i];
}

constexpr float kRoot = 1.41421356F;  // the points are 0, +-sqrt(1/2), +-sqrt(2), infinity
constexpr float kHalfRoot = 0.70710678F;

/// B^T times x for one row or column, in three pairs that share their terms; x5 or x0 may be
/// anything where they have no part.
enum class RowPair { outer, inner_points, outer_points };  // rows 0 and 5, 1 and 2, 3 and 4

template <RowPair kPair>
HWY_INLINE void TransformPair(FloatVec x0, FloatVec x1, FloatVec x2, FloatVec x3, FloatVec x4,
                              FloatVec x5, FloatVec& first, FloatVec& second) {
  const FloatTag d;
  const FloatVec two = hn::Set(d, 2.0F);
  const FloatVec half = hn::Set(d, 0.5F);
  if constexpr (kPair == RowPair::outer) {
    // x0 - 5/2 x2 + x4 and x1 - 5/2 x3 + x5
    first = hn::Add(hn::Sub(x0, hn::Add(x2, x2)), hn::NegMulAdd(half, x2, x4));
    second = hn::Add(hn::Sub(x5, hn::Add(x3, x3)), hn::NegMulAdd(half, x3, x1));
  } else if constexpr (kPair == RowPair::inner_points) {
    const FloatVec root = hn::Set(d, kHalfRoot);
    const FloatVec even = hn::Sub(x4, hn::Add(x2, x2));
    const FloatVec odd = hn::NegMulAdd(two, x1, x3);
    first = hn::MulAdd(root, odd, even);
    second = hn::NegMulAdd(root, odd, even);
  } else {
    const FloatVec root = hn::Set(d, kRoot);
    const FloatVec even = hn::NegMulAdd(half, x2, x4);
    const FloatVec odd = hn::NegMulAdd(half, x1, x3);
    first = hn::MulAdd(root, odd, even);
    second = hn::NegMulAdd(root, odd, even);
  }
}

/// B^T times x for one row of six, stored `step` apart.
HWY_INLINE void TransformRow(const FloatVec (&x)[kWindow], float* to, std::ptrdiff_t step) {
  const FloatTag d;
  FloatVec first;
  FloatVec second;
  TransformPair<RowPair::outer>(x[0], x[1], x[2], x[3], x[4], x[5], first, second);
  hn::Store(first, d, to);
  hn::Store(second, d, to + 5 * step);
  TransformPair<RowPair::inner_points>(x[0], x[1], x[2], x[3], x[4], x[5], first, second);
  hn::Store(first, d, to + step);
  hn::Store(second, d, to + 2 * step);
  TransformPair<RowPair::outer_points>(x[0], x[1], x[2], x[3], x[4], x[5], first, second);
  hn::Store(first, d, to + 3 * step);
  hn::Store(second, d, to + 4 * step);
}

/// A 6x6 input tile: rows of pixels, `pixel` floats apart; columns outside [begin, end) are zero.
struct InputTile {
  const float* rows[kWindow];
  std::ptrdiff_t pixel;
  int begin;
  int end;
};

template <RowPair kPair>
HWY_INLINE void TransformRowPair(const InputTile& tile, int first_row, int second_row, float* to,
                                 std::ptrdiff_t step) {
  const FloatTag d;
  FloatVec first[kWindow];
  FloatVec second[kWindow];
#pragma GCC unroll 6
  for (int j = 0; j < kWindow; ++j) {
    first[j] = second[j] = hn::Zero(d);
    if (j < tile.begin || j >= tile.end) continue;
    const std::ptrdiff_t at = j * tile.pixel;
    const FloatVec x1 = hn::LoadU(d, tile.rows[1] + at);
    const FloatVec x2 = hn::LoadU(d, tile.rows[2] + at);
    const FloatVec x3 = hn::LoadU(d, tile.rows[3] + at);
    const FloatVec x4 = hn::LoadU(d, tile.rows[4] + at);
    FloatVec x0 = x1;  // not read unless outer
    FloatVec x5 = x1;
    if constexpr (kPair == RowPair::outer) {
      x0 = hn::LoadU(d, tile.rows[0] + at);
      x5 = hn::LoadU(d, tile.rows[5] + at);
    }
    TransformPair<kPair>(x0, x1, x2, x3, x4, x5, first[j], second[j]);
  }
  TransformRow(first, to + first_row * kWindow * step, step);
  TransformRow(second, to + second_row * kWindow * step, step);
}

/// B^T x B of one vector of channels; position p goes to to[p * step].
HWY_INLINE void TransformInput(const InputTile& tile, float* to, std::ptrdiff_t step) {
  TransformRowPair<RowPair::outer>(tile, 0, 5, to, step);
  TransformRowPair<RowPair::inner_points>(tile, 1, 2, to, step);
  TransformRowPair<RowPair::outer_points>(tile, 3, 4, to, step);
}

/// A^T times m for one row or column of six.
HWY_INLINE void TransformBack(FloatVec m0, FloatVec m1, FloatVec m2, FloatVec m3, FloatVec m4,
                              FloatVec m5, FloatVec (&y)[kTile]) {
  const FloatTag d;
  const FloatVec sum1 = hn::Add(m1, m2);
  const FloatVec difference1 = hn::Sub(m1, m2);
  const FloatVec sum2 = hn::Add(m3, m4);
  const FloatVec difference2 = hn::Sub(m3, m4);
  y[0] = hn::Add(hn::Add(m0, sum1), sum2);
  y[1] = hn::Mul(hn::Set(d, kHalfRoot), hn::MulAdd(hn::Set(d, 2.0F), difference2, difference1));
  y[2] = hn::Mul(hn::Set(d, 0.5F), hn::MulAdd(hn::Set(d, 4.0F), sum2, sum1));
  y[3] = hn::MulAdd(hn::Set(d, kHalfRoot / 2),
                    hn::MulAdd(hn::Set(d, 8.0F), difference2, difference1), m5);
}

/// The first step of A^T m A: down the columns.
HWY_INLINE void TransformColumnsBack(const float* from, std::ptrdiff_t step,
                                     FloatVec (&rows)[kTile][kWindow]) {
  const FloatTag d;
#pragma GCC unroll 6
  for (int j = 0; j < kWindow; ++j) {
    const float* const m = from + j * step;
    FloatVec y[kTile];
    TransformBack(hn::Load(d, m), hn::Load(d, m + 6 * step), hn::Load(d, m + 12 * step),
                  hn::Load(d, m + 18 * step), hn::Load(d, m + 24 * step),
                  hn::Load(d, m + 30 * step), y);
#pragma GCC unroll 4
    for (int i = 0; i < kTile; ++i) rows[i][j] = y[i];
  }
}

/// A times y: the adjoint of TransformBack, for gradients.
HWY_INLINE void SpreadGradient(const FloatVec (&y)[kTile], FloatVec (&m)[kWindow]) {
  const FloatTag d;
  const FloatVec half = hn::Set(d, 0.5F);
  const FloatVec two = hn::Set(d, 2.0F);
  const FloatVec even1 = hn::MulAdd(half, y[2], y[0]);
  const FloatVec odd1 = hn::Mul(hn::Set(d, kHalfRoot), hn::MulAdd(half, y[3], y[1]));
  const FloatVec even2 = hn::MulAdd(two, y[2], y[0]);
  const FloatVec odd2 = hn::Mul(hn::Set(d, kRoot), hn::MulAdd(two, y[3], y[1]));
  m[0] = y[0];
  m[1] = hn::Add(even1, odd1);
  m[2] = hn::Sub(even1, odd1);
  m[3] = hn::Add(even2, odd2);
  m[4] = hn::Sub(even2, odd2);
  m[5] = y[3];
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#endif
