// SPDX-License-Identifier: Apache-2.0
#include "sdmt/image/color_histogram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "reid/formula_network.h"

namespace sdmt::image {
namespace {

using reid::testing_support::FormulaCrop;
using reid::testing_support::kFormulaCrops;

double distance(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

// Against OpenCV and numpy (tests/parity/make_color_histograms.py), shrinking and growing: every
// pixel must fall into the same bin.
TEST(ColorHistogram, EqualsOpenCvs) {
  const io::Safetensors fixture(std::filesystem::path(SDMT_TESTS_DIR) /
                                "image/fixtures/color_histograms.safetensors");
  const auto rects = fixture.read_integers("rects");
  std::vector<FormulaCrop> pictures;
  for (int i = 0; i < kFormulaCrops; ++i) pictures.emplace_back(i);
  std::vector<float> expected(kColorHistogramSize);
  std::vector<float> ours(kColorHistogramSize);
  ASSERT_GE(rects.size(), 5U * 60U);
  for (std::size_t r = 0; r < rects.size() / 5; ++r) {
    const auto number = [&](std::size_t i) { return static_cast<double>(rects[r * 5 + i]); };
    const FormulaCrop& picture = pictures[rects[r * 5]];
    fixture.read_floats(fixture.at("histograms"), expected, r * kColorHistogramSize);
    ASSERT_TRUE(
        color_histogram(picture.view(), {number(1), number(2), number(3), number(4)}, ours));
    EXPECT_LT(distance(ours, expected), 1e-6) << number(3) << " x " << number(4);
  }
}

TEST(ColorHistogram, HasUnitLengthAndDoesNotDependOnTheChannelOrder) {
  FormulaCrop picture(4);
  std::vector<float> bgr(kColorHistogramSize);
  std::vector<float> rgb(kColorHistogramSize);
  ASSERT_TRUE(color_histogram(picture.view(), picture.rect(), bgr));
  EXPECT_NEAR(distance(bgr, std::vector<float>(kColorHistogramSize)), 1.0, 1e-6);
  for (std::size_t i = 0; i < picture.pixels.size(); i += 3) {
    std::swap(picture.pixels[i], picture.pixels[i + 2]);
  }
  ImageView swapped = picture.view();
  swapped.order = ChannelOrder::rgb;
  ASSERT_TRUE(color_histogram(swapped, picture.rect(), rgb));
  EXPECT_EQ(bgr, rgb);
}

TEST(ColorHistogram, PureColoursFallIntoTheirBins) {
  const auto bins_of = [](std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 64 * 32; ++i) pixels.insert(pixels.end(), {r, g, b});
    std::vector<float> out(kColorHistogramSize);
    EXPECT_TRUE(
        color_histogram({pixels.data(), 32, 64, 96, ChannelOrder::rgb}, {0, 0, 32, 64}, out));
    std::vector<int> used;
    for (int i = 0; i < 36; ++i) {
      if (out[static_cast<std::size_t>(i)] > 0) used.push_back(i);
    }
    return used;
  };
  // Bins are hue (22.5 steps of 2 degrees) * 4 + saturation, then 32 + value.
  EXPECT_EQ(bins_of(255, 0, 0), (std::vector<int>{0 * 4 + 3, 35}));   // hue 0
  EXPECT_EQ(bins_of(0, 255, 0), (std::vector<int>{2 * 4 + 3, 35}));   // hue 60
  EXPECT_EQ(bins_of(0, 0, 255), (std::vector<int>{5 * 4 + 3, 35}));   // hue 120
  EXPECT_EQ(bins_of(255, 0, 43), (std::vector<int>{7 * 4 + 3, 35}));  // hue 175
  EXPECT_EQ(bins_of(100, 100, 100), (std::vector<int>{0, 32 + 1}));
  EXPECT_EQ(bins_of(0, 0, 0), (std::vector<int>{0, 32}));
}

TEST(ColorHistogram, RefusesWhatShowsNothing) {
  const FormulaCrop picture(0);
  std::vector<float> out(kColorHistogramSize, 7.0F);
  EXPECT_FALSE(color_histogram(picture.view(), {500, 0, 20, 40}, out));
  EXPECT_FALSE(color_histogram(ImageView{}, {0, 0, 20, 40}, out));
  EXPECT_EQ(out.front(), 7.0F);
  EXPECT_TRUE(color_histogram(picture.view(), {0, 0, 2, 2}, out));
  EXPECT_THROW(color_histogram(picture.view(), picture.rect(), std::span(out).first(10)),
               std::invalid_argument);
}

TEST(ColorHistogram, ADescriptorsRowsAreTheHistograms) {
  const FormulaCrop picture(3);
  ColorHistogramDescriptor descriptor;
  DescriptorRows rows;
  const std::vector<Crop> crops{{picture.view(), picture.rect()},
                                {picture.view(), {500, 0, 20, 40}},
                                {picture.view(), {2, 3, 9, 9}}};
  descriptor.describe(crops, rows);
  EXPECT_EQ(rows.dimension, descriptor.dimension());
  EXPECT_EQ(rows.valid, (std::vector<unsigned char>{1, 0, 1}));
  std::vector<float> expected(kColorHistogramSize);
  EXPECT_EQ(std::vector<float>(rows.row(1).begin(), rows.row(1).end()), expected);  // zeros
  for (const std::size_t i : {0, 2}) {
    ASSERT_TRUE(color_histogram(picture.view(), crops[i].rect, expected));
    EXPECT_EQ(std::vector<float>(rows.row(i).begin(), rows.row(i).end()), expected) << i;
  }
}

// A descriptor that shares no work between windows sees each as a crop of its own.
TEST(ColorHistogram, ShiftedWindowsAreCrops) {
  const FormulaCrop picture(15);  // 295 x 155 pixels
  ColorHistogramDescriptor descriptor;
  DescriptorRows shifted;
  DescriptorRows crops;
  const std::vector<GridShift> shifts{{0, 0}, {-4, 5}, {7, -2}};  // cells of 2 x 3 pixels
  descriptor.describe_shifted(picture.view(), {60, 90, 32, 96}, shifts, shifted);
  descriptor.describe(std::vector<Crop>{{picture.view(), {60, 90, 32, 96}},
                                        {picture.view(), {52, 105, 32, 96}},
                                        {picture.view(), {74, 84, 32, 96}}},
                      crops);
  EXPECT_EQ(shifted.values, crops.values);
  EXPECT_EQ(shifted.valid, crops.valid);
  EXPECT_NE(std::vector<float>(shifted.row(0).begin(), shifted.row(0).end()),
            std::vector<float>(shifted.row(1).begin(), shifted.row(1).end()));
}

}  // namespace
}  // namespace sdmt::image
