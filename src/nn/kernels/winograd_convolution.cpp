// SPDX-License-Identifier: Apache-2.0
#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "kernels/rgb_convolution.h"
#include "kernels/scratch.h"
#include "kernels/winograd.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/winograd_convolution.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/winograd_tile-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_WINOGRAD_CONVOLUTION_ONCE_
#define SDMT_NN_WINOGRAD_CONVOLUTION_ONCE_
struct WinogradTask {
  const Tensor* x;         // either
  const RgbRows* made_of;  // or
  const WinogradWeights& weights;
  const ConvolutionEpilogue& epilogue;
  Tensor& y;
  WinogradTiles tiles;
};
/// What goes through the three steps together: some tiles, and all their output channels or one of
/// several shares of them.
struct WinogradBlock {
  std::int64_t first = 0;
  int slots = 0;
  int share = 0;
  int shares = 1;
};
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

/// What an output tile needs to know besides the values.
struct OutputTile {
  float* y;             // its first pixel
  const float* mask;    // likewise, or null
  std::ptrdiff_t row;   // floats from row to row
  int pixel;            // floats from pixel to pixel
  std::ptrdiff_t next;  // floats to where the next vector goes
  int rows, columns;    // that lie inside, in pixels of y
};

HWY_INLINE void StorePixel(const OutputTile& tile, int i, int j, int channels, FloatVec value) {
  const std::ptrdiff_t at = i * tile.row + static_cast<std::ptrdiff_t>(j) * tile.pixel;
  if (tile.mask != nullptr) {
    const FloatVec mask = LoadSome(tile.mask + at, channels);
    value = hn::IfThenElseZero(hn::Gt(mask, hn::Zero(FloatTag())), value);
  }
  hwy::Prefetch(tile.y + at + tile.next);
  StoreSome(value, tile.y + at, channels);
}

/// A^T m A of one vector of channels, `channels` of which exist; then pooling, bias, ReLU, mask.
template <int kHeight, int kWidth, bool kPool>
HWY_INLINE void TransformOutput(const float* m, std::ptrdiff_t step, std::ptrdiff_t ahead,
                                FloatVec bias, bool relu, int channels, const OutputTile& tile) {
  const FloatTag d;
  alignas(64) float lines[kHeight][kWidth + 2][kLanes];
  TransformColumnsBack<kHeight, kWidth>(m, step, ahead, lines);
  constexpr int kShrink = kPool ? 2 : 1;
  for (int i = 0; i < std::min(tile.rows, kHeight / kShrink); ++i) {
    FloatVec y[kWidth];
#pragma GCC unroll 2
    for (int part = 0; part < kShrink; ++part) {
      FloatVec line[kWidth + 2];
      FloatVec values[kWidth];
#pragma GCC unroll 10
      for (int j = 0; j < kWidth + 2; ++j) line[j] = hn::Load(d, lines[i * kShrink + part][j]);
      TransformLineBack<kWidth>(line, values);
#pragma GCC unroll 8
      for (int j = 0; j < kWidth; ++j) y[j] = part == 0 ? values[j] : hn::Max(y[j], values[j]);
    }
#pragma GCC unroll 8
    for (int j = 0; j < kWidth / kShrink; ++j) {
      if (j >= tile.columns) break;
      // Rounding is monotonic: bias and ReLU may follow the maximum.
      FloatVec value = kPool ? hn::Max(y[2 * j], y[2 * j + 1]) : y[j];
      value = hn::Add(value, bias);
      if (relu) value = Rectify(value);
      StorePixel(tile, i, j, channels, value);
    }
  }
}

/// Output channels [begin, end); begin at a panel of columns of the weights.
struct ChannelRange {
  int begin, end;
  int panels() const { return (end - begin + kColumns - 1) / kColumns; }
};

ChannelRange ChannelsOf(const WinogradTask& task, const WinogradBlock& block) {
  const int out = task.weights.out_channels();
  const int panels = ChannelRange{0, out}.panels();
  return {panels * block.share / block.shares * kColumns,
          std::min(out, panels * (block.share + 1) / block.shares * kColumns)};
}

template <int kHeight, int kWidth>
HWY_NOINLINE void TransformOutputTile(const WinogradTask& task, std::int64_t index,
                                      const ChannelRange& range, int slots, int slot,
                                      const float* m, std::ptrdiff_t step) {
  const FloatTag d;
  const ConvolutionEpilogue& epilogue = task.epilogue;
  const WinogradTiles::Place place = task.tiles.place(index);
  const Shape shape = task.y.shape();
  const int shrink = epilogue.max_pool ? 2 : 1;
  const int top = place.top / shrink;
  const int left = place.left / shrink;
  OutputTile tile;
  tile.row = std::ptrdiff_t{shape.w} * shape.c;
  tile.pixel = shape.c;
  tile.rows = std::min(kHeight / shrink, shape.h - top);
  tile.columns = std::min(kWidth / shrink, shape.w - left);
  const std::ptrdiff_t corner = top * tile.row + std::ptrdiff_t{left} * shape.c;
  float* const y = task.y.image(place.image) + corner;
  const float* const mask =
      epilogue.mask == nullptr ? nullptr : epilogue.mask->image(place.image) + corner;
  for (int channel = range.begin; channel < range.end; channel += kLanes) {
    const int count = std::min(kLanes, range.end - channel);
    const FloatVec bias =
        epilogue.bias == nullptr ? hn::Zero(d) : LoadSome(epilogue.bias + channel, count);
    const float* const from =
        m + static_cast<std::ptrdiff_t>((channel - range.begin) / kLanes * slots + slot) * kLanes;
    // The next channels, then the next tile.
    const bool more = channel + kLanes < range.end;
    const std::ptrdiff_t ahead =
        more ? std::ptrdiff_t{slots} * kLanes : m + (std::ptrdiff_t{slot} + 1) * kLanes - from;
    tile.y = y + channel;
    tile.next = more ? kLanes : kWidth / shrink * shape.c + range.begin - channel;
    tile.mask = mask == nullptr ? nullptr : mask + channel;
    if (epilogue.max_pool) {
      TransformOutput<kHeight, kWidth, true>(from, step, ahead, bias, epilogue.relu, count, tile);
    } else {
      TransformOutput<kHeight, kWidth, false>(from, step, ahead, bias, epilogue.relu, count, tile);
    }
  }
}

/// The rows of the input that a block within one image needs, made here.
ImageRows MakeRows(const WinogradTask& task, const WinogradBlock& block) {
  const WinogradTiles& tiles = task.tiles;
  const WinogradTiles::Place place = tiles.place(block.first);
  const int last_top = tiles.place(block.first + block.slots - 1).top;
  const int first = std::max(0, place.top - 1);
  const int rows = std::min(tiles.height, last_top + tiles.size.height + 1) - first;
  const int channels = task.weights.in_channels();
  float* const band = thread_scratch(ScratchUse::band, static_cast<std::size_t>(rows) *
                                                           static_cast<std::size_t>(tiles.width) *
                                                           static_cast<std::size_t>(channels));
  task.made_of->compute(place.image, first, rows, band);
  return {band, first, channels};
}

template <int kHeight, int kWidth>
void TransformInputs(const WinogradTask& task, const WinogradBlock& block, float* v,
                     std::ptrdiff_t step) {
  const std::size_t row =
      (kWidth + 2) * (static_cast<std::size_t>(task.weights.in_channels()) + kLanes);
  float* const zeros = thread_scratch(ScratchUse::columns, row);
  std::fill_n(zeros, row, 0.0F);
  ImageRows image{nullptr, 0, task.weights.in_channels()};
  if (task.made_of != nullptr) image = MakeRows(task, block);
  for (int slot = 0; slot < block.slots; ++slot) {
    const std::int64_t tile = block.first + slot;
    if (task.x != nullptr) image.data = task.x->image(task.tiles.place(tile).image);
    TransformInputTile<kHeight, kWidth>(image, task.tiles, tile, block.slots, slot, zeros, v, step);
  }
}

/// The products of all tiles of the block at one position: v and m are that position's.
void MultiplyPosition(const WinogradTask& task, const ChannelRange& range, int slots, int position,
                      const float* v, float* m) {
  const int in = task.weights.in_channels();
  const int panels = ChannelRange{0, task.weights.out_channels()}.panels();
  const int panel_rows = EvenRows(slots);
  const std::ptrdiff_t panel_size = static_cast<std::ptrdiff_t>(in) * kColumns;
  const float* b = task.weights.data() +
                   (std::ptrdiff_t{position} * panels + range.begin / kColumns) * panel_size;
  for (int panel = 0; panel < range.panels(); ++panel, b += panel_size) {
    for (int row = 0; row < slots; row += panel_rows) {
      RunMicroTile(std::min(panel_rows, slots - row),
                   MicroTile{.a = v + static_cast<std::ptrdiff_t>(row) * kLanes,
                             .a_chunk = static_cast<std::ptrdiff_t>(slots) * kLanes,
                             .b = b,
                             .b_step = kColumns,
                             .b_vector = kLanes,
                             .c = m + static_cast<std::ptrdiff_t>(2 * panel * slots + row) * kLanes,
                             .c_row = kLanes,
                             .c_vector = static_cast<std::ptrdiff_t>(slots) * kLanes,
                             .k = in});
    }
  }
}

template <int kHeight, int kWidth>
void ConvolveTiles(const WinogradTask& task, const WinogradBlock& block) {
  const ChannelRange range = ChannelsOf(task, block);
  const int positions = task.tiles.size.positions();
  const std::ptrdiff_t step = PositionStep(
      std::max(VectorsOf(task.weights.in_channels()), 2 * range.panels()), block.slots);
  // The products of position p are written over the transformed tiles of position p - 1, which are
  // no longer needed: half the memory, so that more of it stays in the level-2 cache.
  float* const m = thread_scratch(ScratchUse::packed_a, (positions + 1) * step);
  float* const v = m + step;
  TransformInputs<kHeight, kWidth>(task, block, v, step);
  for (int p = 0; p < positions; ++p) {
    MultiplyPosition(task, range, block.slots, p, v + p * step, m + p * step);
  }
  for (int slot = 0; slot < block.slots; ++slot) {
    TransformOutputTile<kHeight, kWidth>(task, block.first + slot, range, block.slots, slot, m,
                                         step);
  }
}

/// The three steps for a block, in one thread.
void ConvolveBlock(const WinogradTask& task, const WinogradBlock& block) {
  if (task.tiles.size == WinogradTileSize{8, 8}) {
    ConvolveTiles<8, 8>(task, block);
  } else if (task.tiles.size == WinogradTileSize{2, 4}) {
    ConvolveTiles<2, 4>(task, block);
  } else {
    ConvolveTiles<4, 4>(task, block);
  }
}

bool FusesMultiplyAndAdd() { return HWY_NATIVE_FMA != 0; }

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(ConvolveBlock);
HWY_EXPORT(FusesMultiplyAndAdd);

WinogradTileSize fastest_winograd_tile(int h, int w) {
  if (!HWY_DYNAMIC_DISPATCH(FusesMultiplyAndAdd)()) return {4, 4};
  // For a pair of channels: the multiplications of an image, and the reading of the transformed
  // weights, which costs as much as some multiplications more. Where a few images of small maps
  // come alone, the weights are most of what is read.
  constexpr std::int64_t kReading = 3;
  const auto cost = [h, w](WinogradTileSize tile) {
    const std::int64_t rows = (h + tile.height - 1) / tile.height;
    const std::int64_t columns = (w + tile.width - 1) / tile.width;
    return (rows * columns + kReading) * tile.positions();
  };
  WinogradTileSize best{8, 8};
  for (const WinogradTileSize tile : {WinogradTileSize{4, 4}, WinogradTileSize{2, 4}}) {
    if (cost(tile) < cost(best)) best = tile;
  }
  return best;
}

namespace {

Shape result_shape(Shape in, const WinogradWeights& weights, const ConvolutionEpilogue& epilogue) {
  const int shrink = epilogue.max_pool ? 2 : 1;
  return {in.n, in.h / shrink, in.w / shrink, weights.out_channels()};
}

/// How a convolution is shared out: blocks of tiles, for each of them shares of the channels.
struct Division {
  std::int64_t blocks;
  int shares;
};

Division divide(const WinogradTask& task) {
  // A block's transformed tiles should stay in the level-2 cache; where the weights do not, more
  // tiles have to share one pass over them.
  constexpr std::size_t kLargeWeights = 1 << 20;  // values
  const WinogradWeights& weights = task.weights;
  const bool large = weights.size() > kLargeWeights;
  const std::int64_t most_values = large ? 1 << 21 : 1 << 17;
  const std::int64_t tile_values = std::int64_t{task.tiles.size.positions()} *
                                   std::max(weights.in_channels(), weights.out_channels());
  const std::int64_t most_slots = std::max<std::int64_t>(14, most_values / tile_values);

  // Where each thread would read large weights for a few tiles, it takes a share of the weights
  // instead, for which some tiles are transformed more than once.
  constexpr std::int64_t kFewTiles = 12;
  constexpr int kLeastShare = 32;  // channels
  const int threads = omp_get_max_threads();
  const std::int64_t sharers = large ? threads * kFewTiles / task.tiles.count : 1;
  int shares = static_cast<int>(std::clamp<std::int64_t>(
      std::min<std::int64_t>(sharers, weights.out_channels() / kLeastShare), 1, threads));
  while (threads % shares != 0) --shares;

  // Every thread gets as many pieces.
  const std::int64_t together = threads / shares;
  const std::int64_t blocks = (task.tiles.count + most_slots - 1) / most_slots;
  return {std::min(task.tiles.count, (blocks + together - 1) / together * together), shares};
}

}  // namespace

void winograd_convolution(const Tensor& x, const WinogradWeights& weights,
                          const ConvolutionEpilogue& epilogue, Tensor& y) {
  y.resize(result_shape(x.shape(), weights, epilogue));
  const WinogradTask task{&x,       nullptr, weights,
                          epilogue, y,       WinogradTiles(x.shape(), weights.tile())};
  const Division division = divide(task);
  io::FirstError error;
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (std::int64_t block = 0; block < division.blocks; ++block) {
    for (int share = 0; share < division.shares; ++share) {
      error.guard([&] {
        const std::int64_t first = block * task.tiles.count / division.blocks;
        const std::int64_t end = (block + 1) * task.tiles.count / division.blocks;
        HWY_DYNAMIC_DISPATCH(ConvolveBlock)
        (task, {first, static_cast<int>(end - first), share, division.shares});
      });
    }
  }
  error.rethrow();
}

void winograd_convolution(const RgbRows& x, const WinogradWeights& weights,
                          const ConvolutionEpilogue& epilogue, Tensor& y) {
  y.resize(result_shape(x.shape(), weights, epilogue));
  const WinogradTask task{nullptr,  &x, weights,
                          epilogue, y,  WinogradTiles(x.shape(), weights.tile())};
  // Blocks of whole rows of tiles: two blocks above each other make the rows between them twice.
  constexpr int kMostSlots = 16;
  const int rows = std::max(1, kMostSlots / task.tiles.columns);
  const int blocks = (task.tiles.rows + rows - 1) / rows;
  io::FirstError error;
#pragma omp parallel for collapse(2) schedule(dynamic)
  for (int image = 0; image < x.shape().n; ++image) {
    for (int block = 0; block < blocks; ++block) {
      error.guard([&] {
        const int first = block * rows;
        const int count = std::min(rows, task.tiles.rows - first);
        const std::int64_t tile = std::int64_t{image} * task.tiles.rows + first;
        HWY_DYNAMIC_DISPATCH(ConvolveBlock)
        (task, {tile * task.tiles.columns, count * task.tiles.columns});
      });
    }
  }
  error.rethrow();
}

}  // namespace sdmt::nn
#endif
