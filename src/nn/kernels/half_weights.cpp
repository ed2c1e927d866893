// SPDX-License-Identifier: Apache-2.0
#include "kernels/half_weights.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "kernels/row_products.h"
#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/half_weights.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_HALF_WEIGHTS_ONCE_
#define SDMT_NN_HALF_WEIGHTS_ONCE_
/// Values of a sum whose weights lie together: those of one panel fit the level-2 cache.
constexpr std::int64_t kHalfStretch = 1024;
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

std::int64_t HalfPanels(std::int64_t out) { return (out + kColumns - 1) / kColumns; }

/// Fills the `length` rows from `first` of all panels; false when a weight is not a float16 number.
bool PackHalfStretch(const Tensor& weight, std::int64_t first, std::int64_t length,
                     std::uint16_t* packed) {
  const FloatTag d;
  const HalfTag half_tag;
  const std::int64_t out = weight.shape().n;
  const std::int64_t in = weight.shape().c;
  for (std::int64_t o = 0; o < HalfPanels(out) * kColumns; ++o) {
    std::uint16_t* const to = packed + o / kColumns * length * kColumns + o % kColumns;
    for (std::int64_t k = 0; k < length; k += kLanes) {
      const std::int64_t count = std::min<std::int64_t>(kLanes, length - k);
      alignas(64) hwy::float16_t lanes[kLanes];
      std::uint16_t bits[kLanes] = {};  // the type of float16_t's own depends on the machine
      if (o < out) {
        const FloatVec values = LoadSome(weight.data() + o * in + first + k, count);
        const auto halves = hn::DemoteTo(half_tag, values);
        if (!hn::AllTrue(d, hn::Eq(hn::PromoteTo(d, halves), values))) return false;
        hn::Store(halves, half_tag, lanes);
        std::memcpy(bits, lanes, sizeof(bits));
      }
      for (std::int64_t i = 0; i < count; ++i) to[(k + i) * kColumns] = bits[i];
    }
  }
  return true;
}

/// Sums of one stretch for m rows of x, `x_row` apart: sums[i * padded out + j], set or added to.
void MultiplyHalfStretch(std::int64_t m, std::int64_t length, std::int64_t out, const float* x,
                         std::ptrdiff_t x_row, const std::uint16_t* packed, bool accumulate,
                         float* sums) {
  const FloatTag d;
  const std::int64_t chunks = (length + kLanes - 1) / kLanes;
  float* const a = thread_scratch(ScratchUse::packed_a, chunks * m * kLanes);
  for (std::int64_t i = 0; i < m; ++i) {
    for (std::int64_t k = 0; k < length; k += kLanes) {
      hn::Store(LoadSome(x + i * x_row + k, length - k), d, a + k * m + i * kLanes);
    }
  }
  const std::int64_t panels = HalfPanels(out);
  const int panel_rows = EvenRows(m);
  for (std::int64_t panel = 0; panel < panels; ++panel) {
    const auto* const b =
        reinterpret_cast<const hwy::float16_t*>(packed + panel * length * kColumns);
    for (std::int64_t row = 0; row < m; row += panel_rows) {
      RunMicroTile(static_cast<int>(std::min<std::int64_t>(panel_rows, m - row)),
                   MicroTileOf<hwy::float16_t>{.a = a + row * kLanes,
                                               .a_chunk = m * kLanes,
                                               .b = b,
                                               .b_step = kColumns,
                                               .b_vector = kLanes,
                                               .c = sums + (row * panels + panel) * kColumns,
                                               .c_row = panels * kColumns,
                                               .c_vector = kLanes,
                                               .k = length,
                                               .accumulate = accumulate});
    }
  }
}

std::int64_t HalfPaddedColumns(std::int64_t out) { return HalfPanels(out) * kColumns; }

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(PackHalfStretch);
HWY_EXPORT(MultiplyHalfStretch);
HWY_EXPORT(HalfPaddedColumns);

const std::uint16_t* HalfWeights::data() const {
  return reinterpret_cast<const std::uint16_t*>(memory_.data());
}

bool HalfWeights::set(const Tensor& weight) {
  const std::int64_t in = weight.shape().c;
  const std::int64_t columns = HWY_DYNAMIC_DISPATCH(HalfPaddedColumns)(weight.shape().n);
  memory_.resize({static_cast<int>(in), 1, 1, static_cast<int>((columns + 1) / 2)});
  auto* const packed = reinterpret_cast<std::uint16_t*>(memory_.data());
  std::atomic<bool> exact = true;
  // nothing throws
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t first = 0; first < in; first += kHalfStretch) {
    if (!exact) continue;
    if (!HWY_DYNAMIC_DISPATCH(PackHalfStretch)(weight, first, std::min(kHalfStretch, in - first),
                                               packed + first * columns)) {
      exact = false;
    }
  }
  in_ = exact ? in : 0;
  out_ = exact ? weight.shape().n : 0;
  if (!exact) memory_ = Tensor();
  return exact;
}

void multiply_rows(std::int64_t m, const float* x, const HalfWeights& weights, ProductView c) {
  // Long sums are cut into parts that run in parallel and are added up in order.
  constexpr std::int64_t kPart = 8 * kHalfStretch;
  const std::int64_t k = weights.in_features();
  const std::int64_t n = weights.out_features();
  const std::int64_t columns = HWY_DYNAMIC_DISPATCH(HalfPaddedColumns)(n);
  const std::int64_t parts = (k + kPart - 1) / kPart;
  float* const sums = thread_scratch(ScratchUse::accumulators, parts * m * columns);
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t part = 0; part < parts; ++part) {
    error.guard([&] {
      const std::int64_t begin = part * kPart;
      for (std::int64_t first = begin; first < std::min(k, begin + kPart); first += kHalfStretch) {
        HWY_DYNAMIC_DISPATCH(MultiplyHalfStretch)
        (m, std::min(kHalfStretch, k - first), n, x + first, k, weights.data() + first * columns,
         first > begin, sums + part * m * columns);
      }
    });
  }
  error.rethrow();
  add_parts(m, n, sums, parts, columns, c);
}

}  // namespace sdmt::nn
#endif
