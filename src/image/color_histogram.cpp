// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/color_histogram.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "bilinear_stretch.h"

namespace sdmt::image {

namespace {

constexpr int kChannels = 3;
constexpr int kHeight = 64;
constexpr int kWidth = 32;
constexpr int kFirstColumn = 4;
constexpr int kLastColumn = 28;  // one past
constexpr int kStripes = 8;
constexpr int kHueBins = 8;
constexpr int kSaturationBins = 4;
constexpr int kValueBins = 4;
constexpr int kStripeBins = kHueBins * kSaturationBins + kValueBins;
static_assert(kStripes * kStripeBins == kColorHistogramSize);

using Row = std::array<std::uint8_t, static_cast<std::size_t>(kWidth) * kChannels>;
using Picture = std::array<Row, kHeight>;

// Source positions and weights (which sum to 1) of one output position of an area average.
struct Footprint {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Footprint> footprints(int from, int to) {
  std::vector<Footprint> result(static_cast<std::size_t>(to));
  const double scale = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    Footprint& footprint = result[i];
    const double begin = i * scale;
    const double end = std::min((i + 1) * scale, static_cast<double>(from));
    footprint.first = static_cast<int>(begin);
    for (int j = footprint.first; j < end; ++j) {
      const double covered = std::min<double>(end, j + 1) - std::max<double>(begin, j);
      footprint.weights.push_back(static_cast<float>(covered / (end - begin)));
    }
  }
  return result;
}

void average_areas(const std::uint8_t* origin, std::ptrdiff_t stride, const PixelRegion& region,
                   const std::array<int, kChannels>& channels, Picture& out) {
  const auto columns = footprints(region.width(), kWidth);
  const auto rows = footprints(region.height(), kHeight);
  for (std::size_t y = 0; y < kHeight; ++y) {
    std::array<float, std::tuple_size_v<Row>> sum{};
    for (std::size_t j = 0; j < rows[y].weights.size(); ++j) {
      const std::uint8_t* pixels =
          origin + (rows[y].first + static_cast<std::ptrdiff_t>(j)) * stride;
      for (std::size_t x = 0; x < kWidth; ++x) {
        const std::uint8_t* pixel = pixels + columns[x].first * kChannels;
        for (const float weight : columns[x].weights) {
          for (std::size_t c = 0; c < kChannels; ++c) {
            sum[x * kChannels + c] +=
                rows[y].weights[j] * weight * static_cast<float>(pixel[channels[c]]);
          }
          pixel += kChannels;
        }
      }
    }
    for (std::size_t i = 0; i < sum.size(); ++i) {
      out[y][i] = static_cast<std::uint8_t>(std::lrintf(sum[i]));
    }
  }
}

// cv2.INTER_AREA where a side grows: linear, but whole source pixels are kept where it can.
std::vector<BilinearTap> area_taps(int from, int to) {
  std::vector<BilinearTap> taps;
  const double growth = static_cast<double>(to) / from;
  for (int i = 0; i < to; ++i) {
    const int low = static_cast<int>(i * (1.0 / growth));
    const auto beyond = static_cast<float>((i + 1) - (low + 1) * growth);
    taps.emplace_back(low, beyond <= 0 ? 0.0F : beyond - std::floor(beyond), from);
  }
  return taps;
}

// The region in kHeight x kWidth pixels, RGB, as cv2.resize with INTER_AREA makes it.
Picture shrink(const ImageView& image, const PixelRegion& region) {
  const std::uint8_t* origin =
      image.data + region.top * image.stride + static_cast<std::ptrdiff_t>(region.left) * kChannels;
  std::array<int, kChannels> channels{0, 1, 2};
  if (image.order == ChannelOrder::bgr) channels = {2, 1, 0};
  Picture small{};
  if (region.width() >= kWidth && region.height() >= kHeight) {
    average_areas(origin, image.stride, region, channels, small);
  } else {
    BilinearStretch stretch(origin, image.stride, area_taps(region.width(), kWidth), channels);
    const auto rows = area_taps(region.height(), kHeight);
    for (std::size_t y = 0; y < kHeight; ++y) stretch.row(rows[y], small[y]);
  }
  return small;
}

// scale * numerator / denominator, rounded as OpenCV rounds it: the reciprocal has 12 bits below
// the point.
int scaled_ratio(double scale, int numerator, int denominator) {
  const auto reciprocal = static_cast<int>(std::lrint(scale * 4096 / denominator));
  return (numerator * reciprocal + 2048) >> 12;
}

// OpenCV's 8-bit HSV: hue in steps of 2 degrees (0..179), saturation and value 0..255.
std::array<int, 3> hsv(int r, int g, int b) {
  const int value = std::max({r, g, b});
  const int range = value - std::min({r, g, b});
  if (range == 0) return {0, 0, value};
  int sixths = 0;  // of the colour circle, times range
  if (value == r) {
    sixths = g - b;
  } else if (value == g) {
    sixths = b - r + 2 * range;
  } else {
    sixths = r - g + 4 * range;
  }
  const int hue = scaled_ratio(30, sixths, range);
  return {hue < 0 ? hue + 180 : hue, scaled_ratio(255, range, value), value};
}

}  // namespace

bool color_histogram(const ImageView& image, const PixelRect& rect, std::span<float> out) {
  if (out.size() != kColorHistogramSize) {
    throw std::invalid_argument("a colour histogram has " + std::to_string(kColorHistogramSize) +
                                " values, got room for " + std::to_string(out.size()));
  }
  if (image.empty()) return false;
  const auto region = visible_region(image.width, image.height, rect);
  if (!region) return false;

  const Picture small = shrink(image, *region);
  std::fill(out.begin(), out.end(), 0.0F);
  for (int y = 0; y < kHeight; ++y) {
    const int first_bin = y / (kHeight / kStripes) * kStripeBins;
    const auto bins = out.subspan(static_cast<std::size_t>(first_bin), kStripeBins);
    for (int x = kFirstColumn; x < kLastColumn; ++x) {
      const std::uint8_t* rgb = small[y].data() + x * kChannels;
      const auto [hue, saturation, value] = hsv(rgb[0], rgb[1], rgb[2]);
      const int hue_bin = hue * kHueBins / 180;
      const int saturation_bin = saturation * kSaturationBins / 256;
      const int color_bin = hue_bin * kSaturationBins + saturation_bin;
      const int value_bin = kHueBins * kSaturationBins + value * kValueBins / 256;
      bins[color_bin] += 1.0F;
      bins[value_bin] += 1.0F;
    }
  }
  constexpr float kCounts = 2.0F * kHeight * (kLastColumn - kFirstColumn);
  for (float& count : out) count = std::sqrt(count / kCounts);
  return true;
}

void ColorHistogramDescriptor::describe(std::span<const Crop> crops, DescriptorRows& out) {
  out.reset(crops.size(), kColorHistogramSize);
  for (std::size_t i = 0; i < crops.size(); ++i) {
    out.valid[i] = color_histogram(crops[i].image, crops[i].rect, out.row(i)) ? 1 : 0;
  }
}

}  // namespace sdmt::image
