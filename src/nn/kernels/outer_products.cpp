// SPDX-License-Identifier: Apache-2.0
#include "kernels/outer_products.h"

#include <algorithm>
#include <cstddef>

#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/outer_products.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

// The sums that are open stay in the level-1 cache: a micro-tile of the result is finished, for all
// shards, before the next.

namespace sdmt::nn {
#ifndef SDMT_NN_OUTER_PRODUCTS_ONCE_
#define SDMT_NN_OUTER_PRODUCTS_ONCE_
struct OuterProductsTask {
  const BatchShards& shards;
  std::int64_t out, in;
  const float* dy;
  const float* x;
  const std::vector<float*>& targets;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

std::int64_t OuterProductsPanel() { return kColumns; }

/// Columns [column, column + count) of x, filled up with zeros: [n][kColumns].
void PackColumns(const OuterProductsTask& task, std::int64_t column, std::int64_t count,
                 float* packed) {
  const int images = task.shards.images_here();
  for (int i = 0; i < images; ++i, packed += kColumns) {
    const float* const from = task.x + i * task.in + column;
    hn::Store(LoadSome(from, count), FloatTag(), packed);
    hn::Store(count > kLanes ? LoadSome(from + kLanes, count - kLanes) : hn::Zero(FloatTag()),
              FloatTag(), packed + kLanes);
  }
}

HWY_INLINE void AddSlot(const float* from, int rows, float* to) {
  const FloatTag d;
  for (int i = 0; i < rows * kColumns; i += kLanes) {
    hn::Store(hn::Add(hn::Load(d, to + i), hn::Load(d, from + i)), d, to + i);
  }
}

/// Rows [row, row + rows) of the result in the packed columns, to the slots of the tree; returns
/// how many.
int SumShards(const OuterProductsTask& task, std::int64_t row, int rows, const float* packed,
              float* slots) {
  constexpr int kSlot = kMaxRows * kColumns;
  const BatchShards& shards = task.shards;
  const int first_image = shards.begin(shards.first());
  ShardTree tree;
  for (int s = shards.first(); s < shards.end(); ++s) {
    const int top = tree.top();
    int merges = tree.push({s, 1});
    const int slot = merges > 0 ? top - 1 : top;
    const std::ptrdiff_t begin = shards.begin(s) - first_image;
    const std::int64_t images = shards.begin(s + 1) - shards.begin(s);
    RunMicroTile<1>(rows, MicroTile{.a = task.dy + begin * task.out + row,
                                    .a_step = task.out,
                                    .chunk = std::max<std::int64_t>(images, 1),
                                    .b = packed + begin * kColumns,
                                    .b_step = kColumns,
                                    .b_vector = kLanes,
                                    .c = slots + slot * kSlot,
                                    .c_row = kColumns,
                                    .c_vector = kLanes,
                                    .k = images,
                                    .accumulate = slot != top});
    for (int at = slot; merges > 1; --merges, --at) {
      AddSlot(slots + at * kSlot, rows, slots + (at - 1) * kSlot);
    }
  }
  return tree.top();
}

/// All rows of the result, in a panel of columns.
void OuterProductsOfPanel(const OuterProductsTask& task, std::int64_t column) {
  constexpr int kSlot = kMaxRows * kColumns;
  const std::int64_t count = std::min<std::int64_t>(kColumns, task.in - column);
  float* const packed =
      thread_scratch(ScratchUse::packed_b, static_cast<std::size_t>(task.shards.images_here()) *
                                               static_cast<std::size_t>(kColumns));
  float* const slots = thread_scratch(ScratchUse::accumulators, std::size_t{5} * kSlot);
  PackColumns(task, column, count, packed);
  const int most_rows = EvenRows(task.out);
  for (std::int64_t row = 0; row < task.out; row += most_rows) {
    const int rows = static_cast<int>(std::min<std::int64_t>(most_rows, task.out - row));
    const int nodes = SumShards(task, row, rows, packed, slots);
    for (int node = 0; node < nodes; ++node) {
      for (int i = 0; i < rows; ++i) {
        float* const to = task.targets[node] + (row + i) * task.in + column;
        const float* const from = slots + node * kSlot + i * kColumns;
        for (std::int64_t j = 0; j < count; ++j) to[j] += from[j];
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

HWY_EXPORT(OuterProductsPanel);
HWY_EXPORT(OuterProductsOfPanel);

void add_outer_products(const BatchShards& shards, std::int64_t out, std::int64_t in,
                        const float* dy, const float* x, const std::vector<float*>& targets) {
  const OuterProductsTask task{shards, out, in, dy, x, targets};
  const std::int64_t panel = HWY_DYNAMIC_DISPATCH(OuterProductsPanel)();
  io::FirstError error;
#pragma omp parallel for schedule(dynamic, 4)
  for (std::int64_t column = 0; column < in; column += panel) {
    error.guard([&] { HWY_DYNAMIC_DISPATCH(OuterProductsOfPanel)(task, column); });
  }
  error.rethrow();
}

}  // namespace sdmt::nn
#endif
