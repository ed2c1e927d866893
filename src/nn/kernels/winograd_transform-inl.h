// SPDX-License-Identifier: Apache-2.0
// The tile transforms of winograd.h over vectors of channels. Included like micro_kernel-inl.h.
#if defined(SDMT_NN_WINOGRAD_TRANSFORM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#undef SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#else
#define SDMT_NN_WINOGRAD_TRANSFORM_INL_H_
#endif

#include <hwy/cache_control.h>

#include "kernels/micro_kernel-inl.h"
#include "kernels/winograd_points.h"

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

/// B^T times x for one row or column, kTile + 2 values.
template <int kTile>
HWY_INLINE void TransformLine(const FloatVec (&x)[kTile + 2], FloatVec (&v)[kTile + 2]) {
  const FloatTag d;
  constexpr int kPairs = kTile / 2;
  constexpr WinogradCoefficients<kTile> kCoefficients;
  constexpr bool kPlus = kCoefficients.product[0] > 0.0;
  FloatVec first = kPlus ? hn::Add(x[0], x[kTile]) : hn::Sub(x[kTile], x[0]);
  FloatVec last = kPlus ? hn::Add(x[1], x[kTile + 1]) : hn::Sub(x[kTile + 1], x[1]);
#pragma GCC unroll 4
  for (int k = 1; k < kPairs; ++k) {
    const FloatVec c = hn::Set(d, static_cast<float>(kCoefficients.product[k]));
    first = hn::MulAdd(c, x[2 * k], first);
    last = hn::MulAdd(c, x[2 * k + 1], last);
  }
  v[0] = first;
  v[kTile + 1] = last;
#pragma GCC unroll 4
  for (int i = 0; i < kPairs; ++i) {
    FloatVec even = x[kTile];
    FloatVec odd = x[kTile - 1];
#pragma GCC unroll 4
    for (int k = kPairs - 2; k >= 0; --k) {
      const FloatVec c = hn::Set(d, static_cast<float>(kCoefficients.others[i][k]));
      even = hn::MulAdd(c, x[2 * k + 2], even);
      odd = hn::MulAdd(c, x[2 * k + 1], odd);
    }
    const FloatVec p = hn::Set(d, static_cast<float>(kCoefficients.point[i]));
    v[2 * i + 1] = hn::MulAdd(p, odd, even);
    v[2 * i + 2] = hn::NegMulAdd(p, odd, even);
  }
}

/// A^T times m for one row or column, kTile + 2 values.
template <int kTile>
HWY_INLINE void TransformLineBack(const FloatVec (&m)[kTile + 2], FloatVec (&y)[kTile]) {
  const FloatTag d;
  constexpr int kPairs = kTile / 2;
  constexpr WinogradCoefficients<kTile> kCoefficients;
  FloatVec even[kPairs];
  FloatVec odd[kPairs];
#pragma GCC unroll 4
  for (int i = 0; i < kPairs; ++i) {
    even[i] = hn::Add(m[2 * i + 1], m[2 * i + 2]);
    odd[i] = hn::Sub(m[2 * i + 1], m[2 * i + 2]);
  }
#pragma GCC unroll 8
  for (int j = 0; j < kTile; ++j) {
    const FloatVec(&terms)[kPairs] = j % 2 == 0 ? even : odd;
    if (j == 0) {
      y[j] = hn::Add(m[0], terms[0]);
    } else if (j == kTile - 1) {
      y[j] = hn::MulAdd(hn::Set(d, static_cast<float>(kCoefficients.power[0][j])), terms[0],
                        m[kTile + 1]);
    } else {
      y[j] = hn::Mul(hn::Set(d, static_cast<float>(kCoefficients.power[0][j])), terms[0]);
    }
#pragma GCC unroll 4
    for (int i = 1; i < kPairs; ++i) {
      const FloatVec c = hn::Set(d, static_cast<float>(kCoefficients.power[i][j]));
      y[j] = j == 0 ? hn::Add(terms[i], y[j]) : hn::MulAdd(c, terms[i], y[j]);
    }
  }
}

/// An input tile: rows of pixels, `pixel` floats apart; columns outside [begin, end) are zero. The
/// next tile stands `ahead` floats further: its values are asked for while this one is worked on,
/// as the hardware does not see the pattern.
template <int kHeight>
struct InputTile {
  const float* rows[kHeight + 2];
  std::ptrdiff_t pixel;
  std::ptrdiff_t ahead;
  int begin;
  int end;
};

/// B^T x B of one vector of channels; position p goes to to[p * step], and where the next vector
/// will go, `next` floats further, is asked for, so that its stores need not wait.
template <int kHeight, int kWidth>
HWY_INLINE void TransformInput(const InputTile<kHeight>& tile, float* to, std::ptrdiff_t step,
                               std::ptrdiff_t next) {
  const FloatTag d;
  alignas(64) float lines[kHeight + 2][kWidth + 2][kLanes];
  for (int j = 0; j < kWidth + 2; ++j) {
    FloatVec v[kHeight + 2];
    if (j < tile.begin || j >= tile.end) {
#pragma GCC unroll 10
      for (int i = 0; i < kHeight + 2; ++i) v[i] = hn::Zero(d);
    } else {
      FloatVec x[kHeight + 2];
#pragma GCC unroll 10
      for (int i = 0; i < kHeight + 2; ++i) {
        const float* const from = tile.rows[i] + j * tile.pixel;
        hwy::Prefetch(from + tile.ahead);
        x[i] = hn::LoadU(d, from);
      }
      TransformLine<kHeight>(x, v);
    }
#pragma GCC unroll 10
    for (int i = 0; i < kHeight + 2; ++i) hn::Store(v[i], d, lines[i][j]);
  }
  for (int i = 0; i < kHeight + 2; ++i, to += (kWidth + 2) * step) {
    FloatVec x[kWidth + 2];
    FloatVec v[kWidth + 2];
#pragma GCC unroll 10
    for (int j = 0; j < kWidth + 2; ++j) x[j] = hn::Load(d, lines[i][j]);
    TransformLine<kWidth>(x, v);
#pragma GCC unroll 10
    for (int j = 0; j < kWidth + 2; ++j) {
      hwy::Prefetch(to + j * step + next);
      hn::Store(v[j], d, to + j * step);
    }
  }
}

/// The first step of A^T m A: down the columns. The next tile stands `ahead` floats further.
template <int kHeight, int kWidth>
HWY_INLINE void TransformColumnsBack(const float* from, std::ptrdiff_t step, std::ptrdiff_t ahead,
                                     float (&lines)[kHeight][kWidth + 2][kLanes]) {
  const FloatTag d;
  for (int j = 0; j < kWidth + 2; ++j, from += step) {
    FloatVec m[kHeight + 2];
    FloatVec y[kHeight];
#pragma GCC unroll 10
    for (int i = 0; i < kHeight + 2; ++i) {
      const float* const value = from + i * (kWidth + 2) * step;
      hwy::Prefetch(value + ahead);
      m[i] = hn::Load(d, value);
    }
    TransformLineBack<kHeight>(m, y);
#pragma GCC unroll 8
    for (int i = 0; i < kHeight; ++i) hn::Store(y[i], d, lines[i][j]);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#endif
