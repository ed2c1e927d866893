// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace sdmt::nn {

namespace {

constexpr int kChannels = 3;
constexpr int kSmallestSide = 2;          // pixels
constexpr double kSmallestVisible = 0.1;  // share of the rectangle's area

// Bilinear stretching of 8-bit pictures in the fixed point of cv2.resize, so that our patches have
// the very pixels that a Python pipeline sees: weights are multiples of 1 / 2048, a stretched row
// keeps 7 bits below the point, and what rows are mixed from is cut to 2 bits before it is rounded.
constexpr float kWeightOne = 2048.0F;

// Where an output pixel of a stretch from `from` to `to` pixels takes its value: source pixels low
// and high (which may be the same at an edge) with their weights.
struct Tap {
  int low;
  int high;
  std::int16_t low_weight;
  std::int16_t high_weight;
};

Tap make_tap(int low, int high, float fraction) {
  return {low, high, static_cast<std::int16_t>(std::lrint((1.0F - fraction) * kWeightOne)),
          static_cast<std::int16_t>(std::lrint(fraction * kWeightOne))};
}

// Position of output pixel i in the source, in whole pixels and a fraction; pixel centres are half
// a pixel from the edges.
std::pair<int, float> source_position(int i, int from, int to) {
  const double scale = 1.0 / (static_cast<double>(to) / from);
  const auto position = static_cast<float>((i + 0.5) * scale - 0.5);
  const auto whole = static_cast<int>(std::floor(position));
  return {whole, position - static_cast<float>(whole)};
}

Tap column_tap(int i, int from, int to) {
  const auto [low, fraction] = source_position(i, from, to);
  if (low < 0) return make_tap(0, 0, 0.0F);
  if (low >= from - 1) return make_tap(from - 1, from - 1, 0.0F);
  return make_tap(low, low + 1, fraction);
}

Tap row_tap(int i, int from, int to) {
  const auto [low, fraction] = source_position(i, from, to);
  return make_tap(std::clamp(low, 0, from - 1), std::clamp(low + 1, 0, from - 1), fraction);
}

}  // namespace

std::optional<PixelRegion> visible_region(int image_width, int image_height,
                                          const PixelRect& rect) {
  const double right = rect.left + rect.width;
  const double bottom = rect.top + rect.height;
  if (!std::isfinite(rect.left) || !std::isfinite(rect.top) || !std::isfinite(right) ||
      !std::isfinite(bottom)) {
    return std::nullopt;
  }
  // Clamped before the conversion, so that no box overflows an int.
  const auto edge = [](double position, int size) {
    return static_cast<int>(std::clamp(std::nearbyint(position), 0.0, static_cast<double>(size)));
  };
  const PixelRegion region{edge(rect.left, image_width), edge(rect.top, image_height),
                           edge(right, image_width), edge(bottom, image_height)};
  if (region.width() < kSmallestSide || region.height() < kSmallestSide) return std::nullopt;
  const double visible = static_cast<double>(region.width()) * region.height();
  if (!(visible >= kSmallestVisible * rect.width * rect.height)) return std::nullopt;
  return region;
}

bool extract_patch(const ImageView& image, const PixelRect& rect,
                   const Preprocessing& preprocessing, float* out) {
  if (image.empty()) return false;
  const auto region = visible_region(image.width, image.height, rect);
  if (!region) return false;

  const auto width = static_cast<std::size_t>(preprocessing.width);
  const std::size_t row_size = width * kChannels;
  // Channel of the image for each channel of the output.
  std::array<int, kChannels> source{0, 1, 2};
  if (image.order != preprocessing.order) source = {2, 1, 0};
  // (v / 255 - mean) / std as v * scale + offset, for each value of an output row.
  std::vector<float> scale(row_size);
  std::vector<float> offset(row_size);
  std::vector<Tap> columns;
  for (std::size_t x = 0; x < width; ++x) {
    Tap column = column_tap(static_cast<int>(x), region->width(), preprocessing.width);
    column.low *= kChannels;
    column.high *= kChannels;
    columns.push_back(column);
    for (std::size_t c = 0; c < kChannels; ++c) {
      scale[x * kChannels + c] = 1.0F / (255.0F * preprocessing.std[c]);
      offset[x * kChannels + c] = -preprocessing.mean[c] / preprocessing.std[c];
    }
  }

  const std::uint8_t* origin = image.data + region->top * image.stride +
                               static_cast<std::ptrdiff_t>(region->left) * kChannels;
  // A source row serves several output rows: it is stretched once, and the last two are kept.
  std::vector<std::int16_t> kept(2 * row_size);
  std::array<int, 2> kept_row{-1, -1};
  const auto stretched = [&](int y) -> const std::int16_t* {
    const auto slot = static_cast<std::size_t>(y % 2);  // neighbours never share a slot
    std::int16_t* row = kept.data() + slot * row_size;
    if (kept_row[slot] == y) return row;
    kept_row[slot] = y;
    const std::uint8_t* pixels = origin + y * image.stride;
    for (const Tap& column : columns) {
      for (const int c : source) {
        const int value = pixels[column.low + c] * column.low_weight +
                          pixels[column.high + c] * column.high_weight;
        *row++ = static_cast<std::int16_t>(value >> 4);
      }
    }
    return kept.data() + slot * row_size;
  };
  for (int y = 0; y < preprocessing.height; ++y) {
    const Tap rows = row_tap(y, region->height(), preprocessing.height);
    const std::int16_t* low = stretched(rows.low);
    const std::int16_t* high = stretched(rows.high);
    float* target = out + static_cast<std::size_t>(y) * row_size;
    for (std::size_t i = 0; i < row_size; ++i) {
      const int mixed = (low[i] * rows.low_weight >> 16) + (high[i] * rows.high_weight >> 16);
      target[i] = static_cast<float>((mixed + 2) >> 2) * scale[i] + offset[i];
    }
  }
  return true;
}

}  // namespace sdmt::nn
