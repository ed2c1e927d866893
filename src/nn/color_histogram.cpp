// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/color_histogram.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::nn {

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

// Source positions and weights (which sum to 1) of one output position.
struct Footprint {
  int first = 0;
  std::vector<float> weights;
};

// As cv2.INTER_AREA: the mean over the area an output position covers if both sides shrink,
// otherwise a linear interpolation that keeps whole source pixels where it can.
std::vector<Footprint> footprints(int from, int to, bool shrinks) {
  std::vector<Footprint> result(static_cast<std::size_t>(to));
  const double scale = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    Footprint& footprint = result[static_cast<std::size_t>(i)];
    const double begin = i * scale;
    if (shrinks) {
      const double end = std::min((i + 1) * scale, static_cast<double>(from));
      footprint.first = static_cast<int>(begin);
      for (int j = footprint.first; j < end; ++j) {
        const double covered = std::min<double>(end, j + 1) - std::max<double>(begin, j);
        footprint.weights.push_back(static_cast<float>(covered / (end - begin)));
      }
    } else {
      footprint.first = std::min(static_cast<int>(begin), from - 1);
      const double beyond = (i + 1) - (footprint.first + 1) / scale;
      const double weight = beyond <= 0 ? 0.0 : beyond - std::floor(beyond);
      footprint.weights.push_back(static_cast<float>(1 - weight));
      if (weight > 0 && footprint.first + 1 < from) {
        footprint.weights.push_back(static_cast<float>(weight));
      } else {
        footprint.weights.front() = 1.0F;
      }
    }
  }
  return result;
}

// Resizes the region to kHeight x kWidth, rounded to 8 bits, channels as in the image.
std::vector<std::uint8_t> shrink(const ImageView& image, const PixelRegion& region) {
  const bool shrinks = region.width() >= kWidth && region.height() >= kHeight;
  const auto columns = footprints(region.width(), kWidth, shrinks);
  const auto rows = footprints(region.height(), kHeight, shrinks);
  constexpr std::size_t kRow = static_cast<std::size_t>(kWidth) * kChannels;
  std::vector<std::uint8_t> small;
  small.reserve(kHeight * kRow);
  for (const Footprint& row : rows) {
    std::array<float, kRow> sum{};
    for (std::size_t j = 0; j < row.weights.size(); ++j) {
      const std::uint8_t* pixels =
          image.data + (region.top + row.first + static_cast<std::ptrdiff_t>(j)) * image.stride +
          static_cast<std::ptrdiff_t>(region.left) * kChannels;
      for (std::size_t x = 0; x < kWidth; ++x) {
        const std::uint8_t* pixel = pixels + columns[x].first * kChannels;
        for (const float weight : columns[x].weights) {
          for (std::size_t c = 0; c < kChannels; ++c) {
            sum[x * kChannels + c] += row.weights[j] * weight * static_cast<float>(pixel[c]);
          }
          pixel += kChannels;
        }
      }
    }
    for (const float value : sum) small.push_back(static_cast<std::uint8_t>(std::lrintf(value)));
  }
  return small;
}

// numerator / denominator to the nearest whole number, halves up.
int rounded_ratio(int numerator, int denominator) {
  return static_cast<int>(std::floor(static_cast<double>(numerator) / denominator + 0.5));
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
  const int hue = rounded_ratio(30 * sixths, range);
  return {hue < 0 ? hue + 180 : hue, rounded_ratio(255 * range, value), value};
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

  const std::vector<std::uint8_t> small = shrink(image, *region);
  const int red = image.order == ChannelOrder::rgb ? 0 : 2;
  std::fill(out.begin(), out.end(), 0.0F);
  for (int y = 0; y < kHeight; ++y) {
    const auto bins =
        out.subspan(static_cast<std::size_t>(y / (kHeight / kStripes) * kStripeBins), kStripeBins);
    for (int x = kFirstColumn; x < kLastColumn; ++x) {
      const std::uint8_t* pixel = small.data() + (y * kWidth + x) * kChannels;
      const auto [hue, saturation, value] = hsv(pixel[red], pixel[1], pixel[2 - red]);
      const int hue_bin = hue * kHueBins / 180;
      const int saturation_bin = saturation * kSaturationBins / 256;
      const int value_bin = value * kValueBins / 256;
      bins[static_cast<std::size_t>(hue_bin * kSaturationBins + saturation_bin)] += 1.0F;
      bins[static_cast<std::size_t>(kHueBins * kSaturationBins + value_bin)] += 1.0F;
    }
  }
  constexpr float kCounts = 2.0F * kHeight * (kLastColumn - kFirstColumn);
  for (float& count : out) count = std::sqrt(count / kCounts);
  return true;
}

}  // namespace sdmt::nn
