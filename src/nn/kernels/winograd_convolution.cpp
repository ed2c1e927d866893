// SPDX-License-Identifier: Apache-2.0
#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "kernels/scratch.h"
#include "kernels/winograd.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/winograd_convolution.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/winograd_tile-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_WINOGRAD_CONVOLUTION_ONCE_
#define SDMT_NN_WINOGRAD_CONVOLUTION_ONCE_
struct WinogradTask {
  const Tensor& x;
  const WinogradWeights& weights;
  const WinogradEpilogue& epilogue;
  Tensor& y;
  WinogradTiles tiles;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

/// What an output tile needs to know besides the values.
struct OutputTile {
  float* y;            // its first pixel
  const float* mask;   // likewise, or null
  std::ptrdiff_t row;  // floats from row to row
  int pixel;           // floats from pixel to pixel
  int rows, columns;   // that lie inside, in pixels of y
};

HWY_INLINE void StorePixel(const OutputTile& tile, int i, int j, int channels, FloatVec value) {
  const std::ptrdiff_t at = i * tile.row + static_cast<std::ptrdiff_t>(j) * tile.pixel;
  if (tile.mask != nullptr) {
    const FloatVec mask = LoadSome(tile.mask + at, channels);
    value = hn::IfThenElseZero(hn::Gt(mask, hn::Zero(FloatTag())), value);
  }
  StoreSome(value, tile.y + at, channels);
}

/// A^T m A of one vector of channels, `channels` of which exist; then pooling, bias, ReLU, mask.
template <bool kPool>
HWY_INLINE void TransformOutput(const float* m, std::ptrdiff_t step, FloatVec bias, bool relu,
                                int channels, const OutputTile& tile) {
  FloatVec rows[kTile][kWindow];
  TransformColumnsBack(m, step, rows);
  FloatVec pooled[2];
#pragma GCC unroll 4
  for (int i = 0; i < kTile; ++i) {
    const FloatVec(&r)[kWindow] = rows[i];
    FloatVec y[kTile];
    TransformBack(r[0], r[1], r[2], r[3], r[4], r[5], y);
    if constexpr (kPool) {
      // Rounding is monotonic: bias and ReLU may follow the maximum.
      const FloatVec left = hn::Max(y[0], y[1]);
      const FloatVec right = hn::Max(y[2], y[3]);
      pooled[0] = i % 2 == 0 ? left : hn::Max(pooled[0], left);
      pooled[1] = i % 2 == 0 ? right : hn::Max(pooled[1], right);
      if (i % 2 == 0 || i / 2 >= tile.rows) continue;
      for (int j = 0; j < 2 && j < tile.columns; ++j) {
        FloatVec value = hn::Add(pooled[j], bias);
        if (relu) value = Rectify(value);
        StorePixel(tile, i / 2, j, channels, value);
      }
    } else {
      if (i >= tile.rows) continue;
#pragma GCC unroll 4
      for (int j = 0; j < kTile; ++j) {
        if (j >= tile.columns) break;
        FloatVec value = hn::Add(y[j], bias);
        if (relu) value = Rectify(value);
        StorePixel(tile, i, j, channels, value);
      }
    }
  }
}

HWY_NOINLINE void TransformOutputTile(const WinogradTask& task, std::int64_t index, int slots,
                                      int slot, const float* m, std::ptrdiff_t step) {
  const FloatTag d;
  const WinogradEpilogue& epilogue = task.epilogue;
  const WinogradTiles::Place place = task.tiles.place(index);
  const Shape shape = task.y.shape();
  const int shrink = epilogue.max_pool ? 2 : 1;
  const int top = place.top / shrink;
  const int left = place.left / shrink;
  OutputTile tile;
  tile.row = std::ptrdiff_t{shape.w} * shape.c;
  tile.pixel = shape.c;
  tile.rows = std::min(kTile / shrink, shape.h - top);
  tile.columns = std::min(kTile / shrink, shape.w - left);
  const std::ptrdiff_t corner = top * tile.row + std::ptrdiff_t{left} * shape.c;
  float* const y = task.y.image(place.image) + corner;
  const float* const mask =
      epilogue.mask == nullptr ? nullptr : epilogue.mask->image(place.image) + corner;
  for (int channel = 0; channel < shape.c; channel += kLanes) {
    const int count = std::min(kLanes, shape.c - channel);
    const FloatVec bias =
        epilogue.bias == nullptr ? hn::Zero(d) : LoadSome(epilogue.bias + channel, count);
    const float* const from =
        m + static_cast<std::ptrdiff_t>(channel / kLanes * slots + slot) * kLanes;
    tile.y = y + channel;
    tile.mask = mask == nullptr ? nullptr : mask + channel;
    if (epilogue.max_pool) {
      TransformOutput<true>(from, step, bias, epilogue.relu, count, tile);
    } else {
      TransformOutput<false>(from, step, bias, epilogue.relu, count, tile);
    }
  }
}

/// Tiles [first, first + slots), in one thread.
void ConvolveTiles(const WinogradTask& task, std::int64_t first, int slots) {
  const int in = task.weights.in_channels();
  const int panels = (task.weights.out_channels() + kColumns - 1) / kColumns;
  // The products of position p are written over the transformed tiles of position p - 1, which are
  // no longer needed: half the memory, so that more of it stays in the level-2 cache.
  const std::ptrdiff_t step = PositionStep(std::max(VectorsOf(in), 2 * panels), slots);
  float* const m =
      thread_scratch(ScratchUse::packed_a, static_cast<std::size_t>((kPositions + 1) * step));
  float* const v = m + step;
  float* const zeros =
      thread_scratch(ScratchUse::columns, static_cast<std::size_t>(kWindow) * (in + kLanes));
  std::fill_n(zeros, kWindow * (in + kLanes), 0.0F);
  for (int slot = 0; slot < slots; ++slot) {
    TransformInputTile(task.x, task.tiles, first + slot, slots, slot, zeros, v, step);
  }
  const int panel_rows = EvenRows(slots);
  const std::ptrdiff_t panel_size = static_cast<std::ptrdiff_t>(in) * kColumns;
  const float* b = task.weights.data();
  for (int p = 0; p < kPositions; ++p) {
    for (int panel = 0; panel < panels; ++panel, b += panel_size) {
      for (int row = 0; row < slots; row += panel_rows) {
        RunMicroTile(std::min(panel_rows, slots - row),
                     MicroTile{.a = v + p * step + static_cast<std::ptrdiff_t>(row) * kLanes,
                               .a_chunk = static_cast<std::ptrdiff_t>(slots) * kLanes,
                               .b = b,
                               .b_step = kColumns,
                               .b_vector = kLanes,
                               .c = m + p * step +
                                    static_cast<std::ptrdiff_t>(2 * panel * slots + row) * kLanes,
                               .c_row = kLanes,
                               .c_vector = static_cast<std::ptrdiff_t>(slots) * kLanes,
                               .k = in});
      }
    }
  }
  for (int slot = 0; slot < slots; ++slot) {
    TransformOutputTile(task, first + slot, slots, slot, m, step);
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(ConvolveTiles);

void winograd_convolution(const Tensor& x, const WinogradWeights& weights,
                          const WinogradEpilogue& epilogue, Tensor& y) {
  const Shape in = x.shape();
  const int shrink = epilogue.max_pool ? 2 : 1;
  y.resize({in.n, in.h / shrink, in.w / shrink, weights.out_channels()});
  const WinogradTask task{x, weights, epilogue, y, WinogradTiles(in)};
  // A block's transformed tiles should stay in the level-2 cache; where the weights do not, more
  // tiles have to share one pass over them. Every thread gets as many blocks.
  constexpr std::size_t kLargeWeights = 1 << 20;  // values
  const std::int64_t most_slots = weights.size() > kLargeWeights ? 56 : 28;
  const std::int64_t threads = omp_get_max_threads();
  std::int64_t blocks = (task.tiles.count + most_slots - 1) / most_slots;
  blocks = std::min(task.tiles.count, (blocks + threads - 1) / threads * threads);
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t block = 0; block < blocks; ++block) {
    const std::int64_t first = block * task.tiles.count / blocks;
    const std::int64_t end = (block + 1) * task.tiles.count / blocks;
    HWY_DYNAMIC_DISPATCH(ConvolveTiles)(task, first, static_cast<int>(end - first));
  }
}

}  // namespace sdmt::nn
#endif
