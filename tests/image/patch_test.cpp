// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/patch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::image {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// An image of random pixels whose memory ends with its last pixel, so that a sanitizer sees every
// read outside; rows are `padding` bytes apart.
struct Image {
  Image(int width, int height, int padding, std::uint64_t seed)
      : stride(width * 3 + padding),
        bytes(new std::uint8_t[static_cast<std::size_t>(stride * (height - 1) + width * 3)]),
        view{bytes.get(), width, height, stride, ChannelOrder::bgr} {
    nn::Random random(seed);
    for (int i = 0; i < stride * (height - 1) + width * 3; ++i) {
      bytes[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(random.below(256));
    }
  }
  int stride;
  std::unique_ptr<std::uint8_t[]> bytes;
  ImageView view;
};

// The definition, without fixed point: sample every output pixel's centre in the region, edges
// replicated.
float expected(const ImageView& image, const PixelRegion& region, const Preprocessing& p, int y,
               int x, int c) {
  const double sy = (y + 0.5) * region.height() / p.height - 0.5;
  const double sx = (x + 0.5) * region.width() / p.width - 0.5;
  double value = 0;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double wy = dy == 0 ? 1 - (sy - std::floor(sy)) : sy - std::floor(sy);
      const double wx = dx == 0 ? 1 - (sx - std::floor(sx)) : sx - std::floor(sx);
      const int py = std::clamp(static_cast<int>(std::floor(sy)) + dy, 0, region.height() - 1);
      const int px = std::clamp(static_cast<int>(std::floor(sx)) + dx, 0, region.width() - 1);
      const int channel = image.order == p.order ? c : 2 - c;
      value +=
          wy * wx * image.data[(region.top + py) * image.stride + (region.left + px) * 3 + channel];
    }
  }
  const auto i = static_cast<std::size_t>(c);
  return static_cast<float>((value / 255 - p.mean[i]) / p.std[i]);
}

TEST(VisibleRegion, RoundsClipsAndRefuses) {
  using R = PixelRegion;
  EXPECT_EQ(visible_region(100, 50, {10, 20, 5, 6}), (R{10, 20, 15, 26}));
  // Python's round(): halves to even.
  EXPECT_EQ(visible_region(100, 50, {10.5, 11.5, 5, 5}), (R{10, 12, 16, 16}));
  EXPECT_EQ(visible_region(100, 50, {-3, -4, 10, 10}), (R{0, 0, 7, 6}));
  EXPECT_EQ(visible_region(100, 50, {95, 45, 10, 10}), (R{95, 45, 100, 50}));
  // A tenth of the area is enough, less is not.
  EXPECT_EQ(visible_region(100, 50, {-9, 0, 10, 20}), std::nullopt);  // one column
  EXPECT_EQ(visible_region(100, 50, {-18, 0, 20, 20}), (R{0, 0, 2, 20}));
  EXPECT_EQ(visible_region(100, 50, {-19, 0, 21, 20}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {0, 0, 2, 2}), (R{0, 0, 2, 2}));
  EXPECT_EQ(visible_region(100, 50, {0, 0, 1.4, 20}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {200, 10, 10, 10}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {0, 0, -10, 10}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {50, 25, -10, -10}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {0, 0, 0, 0}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {-5e8, -5e8, 1e9, 1e9}), std::nullopt);
  EXPECT_EQ(visible_region(100, 50, {-1e308, 0, 1.7e308, 10}), std::nullopt);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_EQ(visible_region(100, 50, {bad, 0, 10, 10}), std::nullopt);
    EXPECT_EQ(visible_region(100, 50, {0, bad, 10, 10}), std::nullopt);
    EXPECT_EQ(visible_region(100, 50, {0, 0, bad, 10}), std::nullopt);
    EXPECT_EQ(visible_region(100, 50, {0, 0, 10, bad}), std::nullopt);
  }
  EXPECT_EQ(visible_region(1, 1, {0, 0, 1, 1}), std::nullopt);
  EXPECT_EQ(visible_region(100, 1, {0, 0, 100, 1}), std::nullopt);
  EXPECT_EQ(visible_region(0, 0, {0, 0, 10, 10}), std::nullopt);
}

TEST(ExtractPatch, FollowsTheDefinitionForAnySizeAndOrder) {
  nn::Random random(5);
  for (int round = 0; round < 60; ++round) {
    const int width = 2 + static_cast<int>(random.below(150));
    const int height = 2 + static_cast<int>(random.below(200));
    const Image image(width, height, static_cast<int>(random.below(5)), random.next());
    Preprocessing p;
    p.height = 1 + static_cast<int>(random.below(140));
    p.width = 1 + static_cast<int>(random.below(70));
    p.order = random.below(2) == 0 ? ChannelOrder::rgb : ChannelOrder::bgr;
    const PixelRect rect{random.uniform(-5, width / 2.0), random.uniform(-5, height / 2.0),
                         random.uniform(2, width + 5.0), random.uniform(2, height + 5.0)};
    const auto region = visible_region(width, height, rect);
    const std::size_t size = static_cast<std::size_t>(p.height * p.width) * 3;
    std::vector<float> out(size + 1, -77.0F);
    ASSERT_EQ(extract_patch(image.view, rect, p, out.data()), region.has_value());
    EXPECT_EQ(out.back(), -77.0F);
    if (!region) {
      EXPECT_EQ(out.front(), -77.0F);
      continue;
    }
    for (int y = 0; y < p.height; ++y) {
      for (int x = 0; x < p.width; ++x) {
        for (int c = 0; c < 3; ++c) {
          // One step of 8 bits: half for rounding, the rest for the fixed point.
          ASSERT_NEAR(out[static_cast<std::size_t>((y * p.width + x) * 3 + c)],
                      expected(image.view, *region, p, y, x, c), 1.0 / 255 / 0.224)
              << "at " << y << " " << x << " " << c << " of " << p.height << " x " << p.width;
        }
      }
    }
  }
}

TEST(ExtractPatch, TinyImagesAndEmptyViewsAreInvalid) {
  Preprocessing p;
  std::vector<float> out(static_cast<std::size_t>(p.height * p.width * 3));
  for (const auto& [width, height] : {std::pair{1, 1}, {100, 1}, {1, 100}}) {
    const Image image(width, height, 0, 1);
    EXPECT_FALSE(extract_patch(image.view, {0, 0, 1e9, 1e9}, p, out.data()));
    EXPECT_FALSE(extract_patch(image.view, {0, 0, 1.0 * width, 1.0 * height}, p, out.data()));
  }
  EXPECT_FALSE(extract_patch(ImageView{}, {0, 0, 10, 10}, p, out.data()));
}

}  // namespace
}  // namespace sdmt::image
