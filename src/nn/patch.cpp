// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace sdmt::nn {

namespace {

constexpr int kChannels = 3;
constexpr int kSmallestSide = 2;          // pixels
constexpr double kSmallestVisible = 0.1;  // share of the rectangle's area

// Where an output pixel of a stretch from `from` to `to` pixels takes its value: between source
// pixels low and high, `weight` of the way.
struct Tap {
  int low;
  int high;
  float weight;
};

Tap tap(int i, int from, int to) {
  const double position = (i + 0.5) * from / to - 0.5;  // half-pixel centres
  const int low = static_cast<int>(std::floor(position));
  return {std::clamp(low, 0, from - 1), std::clamp(low + 1, 0, from - 1),
          static_cast<float>(position - low)};
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

  // out = value * scale + offset, channel by channel in the order of the output.
  std::array<float, kChannels> scale{};
  std::array<float, kChannels> offset{};
  std::array<int, kChannels> source{};  // channel of the image
  for (std::size_t c = 0; c < kChannels; ++c) {
    scale[c] = 1.0F / (255.0F * preprocessing.std[c]);
    offset[c] = -preprocessing.mean[c] / preprocessing.std[c];
    const int channel = static_cast<int>(c);
    source[c] = image.order == preprocessing.order ? channel : kChannels - 1 - channel;
  }

  const int width = preprocessing.width;
  const int height = preprocessing.height;
  std::vector<Tap> columns(static_cast<std::size_t>(width));
  for (int x = 0; x < width; ++x) {
    Tap& column = columns[static_cast<std::size_t>(x)] = tap(x, region->width(), width);
    column.low *= kChannels;
    column.high *= kChannels;
  }

  const std::uint8_t* origin = image.data + region->top * image.stride +
                               static_cast<std::ptrdiff_t>(region->left) * kChannels;
  // A source row serves several output rows: stretched and normalised once, kept for two rows.
  const std::size_t row_size = static_cast<std::size_t>(width) * kChannels;
  std::vector<float> kept(2 * row_size);
  std::array<int, 2> kept_row{-1, -1};
  const auto stretched = [&](int y) -> const float* {
    const auto slot = static_cast<std::size_t>(y % 2);  // rows low and low + 1 never collide
    float* row = kept.data() + slot * row_size;
    if (kept_row[slot] == y) return row;
    kept_row[slot] = y;
    const std::uint8_t* pixels = origin + y * image.stride;
    for (std::size_t x = 0; x < columns.size(); ++x) {
      const Tap& column = columns[x];
      for (std::size_t c = 0; c < kChannels; ++c) {
        const float low = pixels[column.low + source[c]];
        const float high = pixels[column.high + source[c]];
        row[x * kChannels + c] = (low + (high - low) * column.weight) * scale[c] + offset[c];
      }
    }
    return row;
  };
  for (int y = 0; y < height; ++y) {
    const Tap rows = tap(y, region->height(), height);
    const float* low = stretched(rows.low);
    const float* high = stretched(rows.high);
    float* target = out + static_cast<std::size_t>(y) * row_size;
    for (std::size_t i = 0; i < row_size; ++i)
      target[i] = low[i] + (high[i] - low[i]) * rows.weight;
  }
  return true;
}

}  // namespace sdmt::nn
