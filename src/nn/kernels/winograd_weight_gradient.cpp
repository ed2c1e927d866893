// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "kernels/scratch.h"
#include "kernels/winograd.h"
#include "kernels/winograd_geometry.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/winograd_weight_gradient.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/winograd_tile-inl.h"

// The gradient of the transformed weights at position p is the product, summed over tiles, of the
// transformed input tile and of the output gradient taken to the same domain by the adjoint of the
// output transform: 36 matrix products [in, tiles] x [tiles, out]. A block of tiles is transformed
// by all threads, then multiplied by all threads, which share the products among them, so that the
// order of every sum is fixed.

namespace sdmt::nn {
#ifndef SDMT_NN_WINOGRAD_WEIGHT_GRADIENT_ONCE_
#define SDMT_NN_WINOGRAD_WEIGHT_GRADIENT_ONCE_
struct WinogradGradientTask {
  const Tensor& x;
  const Tensor& dy;
  WinogradTiles tiles;
  std::int64_t first = 0;  // tile of the block
  int slots = 0;           // tiles in the block
  float* v = nullptr;      // transformed x
  float* d = nullptr;      // transformed dy, and its plain sums over a tile as position 36
  float* sums = nullptr;  // [36][in][out], both filled up to whole vectors; then [out] for the bias
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

constexpr int kTile = 4;        // rows and columns of an output tile
constexpr int kWindow = 6;      // of an input tile
constexpr int kPositions = 36;  // of the transformed tile
constexpr int kSumPosition = kPositions;
constexpr float kRoot = 1.41421356F;  // the points are 0, +-sqrt(1/2), +-sqrt(2), infinity
constexpr float kHalfRoot = 0.70710678F;

/// A times y: the adjoint of the output transform.
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

/// Extents of the arrays of a block, in floats.
struct GradientLayout {
  int in, out;  // channels, filled up to whole vectors and panels
  std::ptrdiff_t v_step, d_step;
};

HWY_INLINE GradientLayout LayoutOf(const WinogradGradientTask& task) {
  const int in = VectorsOf(task.x.shape().c);
  const int out = 2 * ((task.dy.shape().c + kColumns - 1) / kColumns);
  return {in * kLanes, out * kLanes, PositionStep(in, task.slots), PositionStep(out, task.slots)};
}

/// Floats that v, d and sums need for blocks of `slots` tiles.
void GradientScratch(const WinogradGradientTask& task, std::size_t (&floats)[3]) {
  const GradientLayout layout = LayoutOf(task);
  floats[0] = static_cast<std::size_t>(layout.v_step) * kPositions;
  floats[1] = static_cast<std::size_t>(layout.d_step) * (kPositions + 1);
  floats[2] = static_cast<std::size_t>(layout.in) * layout.out * kPositions + layout.out;
}

HWY_NOINLINE void TransformGradientTile(const WinogradGradientTask& task, int slot,
                                        std::ptrdiff_t step) {
  const FloatTag d;
  const Shape shape = task.dy.shape();
  const WinogradTiles::Place place = task.tiles.place(task.first + slot);
  const int rows = std::min(kTile, shape.h - place.top);
  const int columns = std::min(kTile, shape.w - place.left);
  const float* const corner =
      task.dy.image(place.image) + (std::ptrdiff_t{place.top} * shape.w + place.left) * shape.c;
  for (int channel = 0; channel < shape.c; channel += kLanes) {
    const int count = std::min(kLanes, shape.c - channel);
    float* const to =
        task.d + static_cast<std::ptrdiff_t>(channel / kLanes * task.slots + slot) * kLanes;
    // Where the next vector goes is asked for, so that its stores need not wait.
    const std::ptrdiff_t next = channel + kLanes < shape.c ? std::ptrdiff_t{task.slots} * kLanes
                                                           : kLanes - channel * task.slots;
    FloatVec total = hn::Zero(d);
    FloatVec spread[kTile][kWindow];  // dy spread along the rows
#pragma GCC unroll 4
    for (int i = 0; i < kTile; ++i) {
      FloatVec y[kTile];
#pragma GCC unroll 4
      for (int j = 0; j < kTile; ++j) {
        const bool inside = i < rows && j < columns;
        const float* from = corner + (std::ptrdiff_t{i} * shape.w + j) * shape.c + channel;
        y[j] = inside ? LoadSome(from, count) : hn::Zero(d);
      }
      total = hn::Add(total, hn::Add(hn::Add(y[0], y[1]), hn::Add(y[2], y[3])));
      SpreadGradient(y, spread[i]);
    }
#pragma GCC unroll 6
    for (int j = 0; j < kWindow; ++j) {
      const FloatVec y[kTile] = {spread[0][j], spread[1][j], spread[2][j], spread[3][j]};
      FloatVec m[kWindow];
      SpreadGradient(y, m);
#pragma GCC unroll 6
      for (int i = 0; i < kWindow; ++i) {
        float* const position = to + (i * kWindow + j) * step;
        hwy::Prefetch(position + next);
        hn::Store(m[i], d, position);
      }
    }
    hn::Store(total, d, to + kSumPosition * step);
  }
}

void TransformGradientTiles(const WinogradGradientTask& task, int first_slot, int end_slot) {
  const GradientLayout layout = LayoutOf(task);
  const int in = task.x.shape().c;
  const std::size_t row = static_cast<std::size_t>(kWindow) * (in + kLanes);
  float* const zeros = thread_scratch(ScratchUse::columns, row);
  std::fill_n(zeros, row, 0.0F);
  for (int slot = first_slot; slot < end_slot; ++slot) {
    const std::int64_t tile = task.first + slot;
    const ImageRows image{task.x.image(task.tiles.place(tile).image), 0, in};
    TransformInputTile<kTile, kTile>(image, task.tiles, tile, task.slots, slot, zeros, task.v,
                                     layout.v_step);
    TransformGradientTile(task, slot, layout.d_step);
  }
}

constexpr int kRows = kLanes > 8 ? 8 : std::min(kLanes, 4);  // input channels of a micro-tile

/// Products of all tiles of the block at one position, for kRows channels of x from i on and a
/// panel of those of dy from o on.
HWY_INLINE void MultiplyTile(const WinogradGradientTask& task, const GradientLayout& layout,
                             int position, int i, int o, float* sums, std::ptrdiff_t row,
                             bool accumulate) {
  const std::ptrdiff_t vector_step = static_cast<std::ptrdiff_t>(task.slots) * kLanes;
  RunMicroTile<kRows, 1>(
      MicroTile{.a = task.v + position * layout.v_step + i / kLanes * vector_step + i % kLanes,
                .a_step = kLanes,
                .chunk = task.slots,
                .b = task.d + position * layout.d_step + o / kLanes * vector_step,
                .b_step = kLanes,
                .b_vector = vector_step,
                .c = sums,
                .c_row = row,
                .c_vector = kLanes,
                .k = task.slots,
                .accumulate = accumulate});
}

/// The same for all channels.
void MultiplyGradientPosition(const WinogradGradientTask& task, int position) {
  const GradientLayout layout = LayoutOf(task);
  float* const sums = task.sums + static_cast<std::ptrdiff_t>(position) * layout.in * layout.out;
  for (int o = 0; o < layout.out; o += kColumns) {
    for (int i = 0; i < layout.in; i += kRows) {
      MultiplyTile(task, layout, position, i, o,
                   sums + static_cast<std::ptrdiff_t>(i) * layout.out + o, layout.out,
                   task.first > 0);
    }
  }
}

/// The bias's share of the block.
void SumGradientBlock(const WinogradGradientTask& task) {
  const FloatTag d;
  const GradientLayout layout = LayoutOf(task);
  float* const sums = task.sums + static_cast<std::ptrdiff_t>(kPositions) * layout.in * layout.out;
  const float* from = task.d + kSumPosition * layout.d_step;
  for (int o = 0; o < VectorsOf(task.dy.shape().c); ++o) {
    FloatVec total = hn::Zero(d);
    for (int slot = 0; slot < task.slots; ++slot, from += kLanes) {
      total = hn::Add(total, hn::Load(d, from));
    }
    float* const sum = sums + o * kLanes;
    hn::Store(task.first == 0 ? total : hn::Add(hn::Load(d, sum), total), d, sum);
  }
}

/// G^T u for six values: the adjoint of the weight transform.
HWY_INLINE void GatherTaps(const FloatVec (&u)[kWindow], FloatVec (&g)[3]) {
  const FloatTag d;
  const FloatVec inner = hn::Mul(hn::Add(u[1], u[2]), hn::Set(d, -1.0F / 1.5F));
  const FloatVec outer = hn::Mul(hn::Add(u[3], u[4]), hn::Set(d, 1.0F / 6.0F));
  const FloatVec inner_odd = hn::Mul(hn::Sub(u[1], u[2]), hn::Set(d, -kHalfRoot / 1.5F));
  g[0] = hn::Add(u[0], hn::Add(inner, outer));
  g[1] = hn::MulAdd(hn::Sub(u[3], u[4]), hn::Set(d, kRoot / 6.0F), inner_odd);
  g[2] = hn::Add(hn::MulAdd(inner, hn::Set(d, 0.5F), hn::Add(outer, outer)), u[5]);
}

/// Sets `count` values of each of 9 taps, or adds to them, from sums `position` floats apart.
HWY_INLINE void FinishTaps(const float* sums, std::ptrdiff_t position, std::ptrdiff_t count,
                           bool add, float* taps, std::ptrdiff_t tap_step) {
  const FloatTag d;
  for (; count > 0; count -= kLanes, sums += kLanes, taps += kLanes) {
    FloatVec half[kWindow][3];
#pragma GCC unroll 6
    for (int p = 0; p < kWindow; ++p) {
      FloatVec u[kWindow];
#pragma GCC unroll 6
      for (int q = 0; q < kWindow; ++q) {
        const float* const from = sums + (p * kWindow + q) * position;
        hwy::Prefetch(from + 2 * kLanes);
        u[q] = hn::Load(d, from);
      }
      GatherTaps(u, half[p]);
    }
#pragma GCC unroll 3
    for (int b = 0; b < 3; ++b) {
      const FloatVec u[kWindow] = {half[0][b], half[1][b], half[2][b],
                                   half[3][b], half[4][b], half[5][b]};
      FloatVec g[3];
      GatherTaps(u, g);
#pragma GCC unroll 3
      for (int a = 0; a < 3; ++a) {
        float* const tap = taps + (a * 3 + b) * tap_step;
        StoreSome(add ? hn::Add(LoadSome(tap, count), g[a]) : g[a], tap, count);
      }
    }
  }
}

/// Sets taps [9,in,out] of all outputs for input channel i, or adds to them.
void FinishGradient(const WinogradGradientTask& task, int i, bool add, float* taps) {
  const GradientLayout layout = LayoutOf(task);
  const std::ptrdiff_t in = task.x.shape().c;
  const std::ptrdiff_t out = task.dy.shape().c;
  FinishTaps(task.sums + static_cast<std::ptrdiff_t>(i) * layout.out,
             static_cast<std::ptrdiff_t>(layout.in) * layout.out, out, add, taps + i * out,
             in * out);
}

/// Pieces of a gradient, panel of outputs by panel, that MultiplyAndFinish() makes.
int GradientPieces(const WinogradGradientTask& task) {
  return LayoutOf(task).out / kColumns * ((task.x.shape().c + kRows - 1) / kRows);
}

/// A piece of the gradient, from the products at all positions, which never leave the level-1
/// cache. For a task of a single block.
void MultiplyAndFinish(const WinogradGradientTask& task, int piece, bool add, float* taps) {
  const GradientLayout layout = LayoutOf(task);
  const std::ptrdiff_t in = task.x.shape().c;
  const std::ptrdiff_t out = task.dy.shape().c;
  const int in_pieces = static_cast<int>((in + kRows - 1) / kRows);
  const int i = piece % in_pieces * kRows;
  const int o = piece / in_pieces * kColumns;
  alignas(64) float sums[kPositions * kRows * kColumns];
  for (int position = 0; position < kPositions; ++position) {
    MultiplyTile(task, layout, position, i, o, sums + position * kRows * kColumns, kColumns, false);
  }
  for (int row = 0; row < std::min<std::ptrdiff_t>(kRows, in - i); ++row) {
    FinishTaps(sums + row * kColumns, kRows * kColumns, std::min<std::ptrdiff_t>(kColumns, out - o),
               add, taps + (i + row) * out + o, in * out);
  }
}

void FinishBias(const WinogradGradientTask& task, bool add, float* bias_gradient) {
  const GradientLayout layout = LayoutOf(task);
  const float* const sums =
      task.sums + static_cast<std::ptrdiff_t>(kPositions) * layout.in * layout.out;
  for (int o = 0; o < task.dy.shape().c; ++o) {
    bias_gradient[o] = add ? bias_gradient[o] + sums[o] : sums[o];
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(GradientScratch);
HWY_EXPORT(TransformGradientTiles);
HWY_EXPORT(MultiplyGradientPosition);
HWY_EXPORT(SumGradientBlock);
HWY_EXPORT(FinishGradient);
HWY_EXPORT(GradientPieces);
HWY_EXPORT(MultiplyAndFinish);
HWY_EXPORT(FinishBias);

void winograd_weight_gradient(const Tensor& x, const Tensor& dy, bool add, float* taps,
                              float* bias_gradient) {
  // A block's transformed tiles stay in the level-3 cache; long sums make the accumulators, which
  // pass through it once a block, cheap.
  constexpr std::int64_t kBlockValues = 3 << 20;
  constexpr std::int64_t kSlotsPerTask = 8;
  constexpr int kWidestPanel = 32;  // of any instruction set
  const std::int64_t channels = std::int64_t{x.shape().c} + dy.shape().c;
  WinogradGradientTask task{x, dy, WinogradTiles(x.shape(), {.height = 4, .width = 4})};
  const std::int64_t most_slots = std::max<std::int64_t>(64, kBlockValues / (36 * channels));
  const std::int64_t blocks = (task.tiles.count + most_slots - 1) / most_slots;
  task.slots = static_cast<int>((task.tiles.count + blocks - 1) / blocks);
  std::size_t floats[3];
  HWY_DYNAMIC_DISPATCH(GradientScratch)(task, floats);
  task.v = thread_scratch(ScratchUse::packed_a, floats[0]);
  task.d = thread_scratch(ScratchUse::packed_b, floats[1]);
  task.sums = thread_scratch(ScratchUse::accumulators, floats[2]);
  // Channels that only fill up a panel are never transformed, only multiplied.
  if (dy.shape().c % kWidestPanel != 0) std::fill_n(task.d, floats[1], 0.0F);
  // Where few tiles are summed, what passes through memory are the sums: then they are finished
  // piece by piece, before they leave the cache.
  constexpr std::int64_t kFewTiles = 128;
  const bool few = task.tiles.count <= kFewTiles && blocks == 1;
  const int pieces = few ? HWY_DYNAMIC_DISPATCH(GradientPieces)(task) : 0;
  for (std::int64_t block = 0; block < blocks; ++block) {
    task.first = block * task.tiles.count / blocks;
    task.slots = static_cast<int>((block + 1) * task.tiles.count / blocks - task.first);
    const std::int64_t tasks = (task.slots + kSlotsPerTask - 1) / kSlotsPerTask;
    io::FirstError error;
#pragma omp parallel
    {
#pragma omp for schedule(dynamic)
      for (std::int64_t part = 0; part < tasks; ++part) {
        error.guard([&] {
          HWY_DYNAMIC_DISPATCH(TransformGradientTiles)
          (task, static_cast<int>(part * task.slots / tasks),
           static_cast<int>((part + 1) * task.slots / tasks));
        });
      }
#pragma omp for schedule(dynamic)
      for (int position = few ? 36 : 0; position <= 36; ++position) {
        if (position < 36) {
          HWY_DYNAMIC_DISPATCH(MultiplyGradientPosition)(task, position);
        } else {
          HWY_DYNAMIC_DISPATCH(SumGradientBlock)(task);
        }
      }
#pragma omp for schedule(dynamic, 8)
      for (int piece = 0; piece < pieces; ++piece) {
        HWY_DYNAMIC_DISPATCH(MultiplyAndFinish)(task, piece, add, taps);
      }
    }
    error.rethrow();
  }
  if (!few) {
    // nothing throws
#pragma omp parallel for schedule(static)
    for (int i = 0; i < x.shape().c; ++i) {
      HWY_DYNAMIC_DISPATCH(FinishGradient)(task, i, add, taps);
    }
  }
  if (bias_gradient != nullptr) HWY_DYNAMIC_DISPATCH(FinishBias)(task, add, bias_gradient);
}

void add_winograd_taps(const float* taps, Shape weight, float* weight_gradient) {
  constexpr int kBlock = 16;
  const int out = weight.n, in = weight.c;
  // nothing throws
#pragma omp parallel for schedule(static)
  for (int block = 0; block < out; block += kBlock) {
    const int end = std::min(out, block + kBlock);
    for (int tap = 0; tap < 9; ++tap) {
      for (int first = 0; first < in; first += kBlock) {
        for (int o = block; o < end; ++o) {
          float* const to = weight_gradient + (std::ptrdiff_t{o} * 9 + tap) * in;
          const float* const from = taps + std::ptrdiff_t{tap} * in * out + o;
          for (int i = first; i < std::min(in, first + kBlock); ++i) {
            to[i] += from[std::ptrdiff_t{i} * out];
          }
        }
      }
    }
  }
}

}  // namespace sdmt::nn
#endif
