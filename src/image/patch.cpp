// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "bilinear_stretch.h"

namespace sdmt::image {

namespace {

constexpr int kChannels = 3;
constexpr int kSmallestSide = 2;          // pixels
constexpr double kSmallestVisible = 0.1;  // share of the rectangle's area

// Output pixel i of a stretch from `from` to `to` pixels; pixel centres are half a pixel from the
// edges.
BilinearTap half_pixel_tap(int i, int from, int to) {
  const double scale = 1.0 / (static_cast<double>(to) / from);
  const auto position = static_cast<float>((i + 0.5) * scale - 0.5);
  const float whole = std::floor(position);
  return {static_cast<int>(whole), position - whole, from};
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

  std::vector<BilinearTap> columns;
  columns.reserve(static_cast<std::size_t>(preprocessing.width));
  for (int x = 0; x < preprocessing.width; ++x) {
    columns.push_back(half_pixel_tap(x, region->width(), preprocessing.width));
  }
  // (v / 255 - mean) / std as v * scale + offset, for each value of a row.
  const std::size_t row_size = columns.size() * kChannels;
  std::vector<float> scale(row_size);
  std::vector<float> offset(row_size);
  for (std::size_t i = 0; i < row_size; ++i) {
    const std::size_t c = i % kChannels;
    scale[i] = 1.0F / (255.0F * preprocessing.std[c]);
    offset[i] = -preprocessing.mean[c] / preprocessing.std[c];
  }

  const std::uint8_t* origin = image.data + region->top * image.stride +
                               static_cast<std::ptrdiff_t>(region->left) * kChannels;
  std::array<int, kChannels> channels{0, 1, 2};
  if (image.order != preprocessing.order) channels = {2, 1, 0};
  BilinearStretch stretch(origin, image.stride, std::move(columns), channels);
  std::vector<std::uint8_t> row(row_size);
  for (int y = 0; y < preprocessing.height; ++y) {
    stretch.row(half_pixel_tap(y, region->height(), preprocessing.height), row);
    float* target = out + static_cast<std::size_t>(y) * row_size;
    for (std::size_t i = 0; i < row_size; ++i) {
      target[i] = static_cast<float>(row[i]) * scale[i] + offset[i];
    }
  }
  return true;
}

}  // namespace sdmt::image
