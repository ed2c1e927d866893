// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/augmentation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "sdmt/train/trainer_options.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;

constexpr AugmentationOptions kNothing{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};

image::Image noise(int width, int height, int low = 60, int high = 180) {
  nn::Random random(1);
  image::Image image(width, height);
  for (auto& value : image.bgr) {
    value = static_cast<std::uint8_t>(
        low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low))));
  }
  return image;
}

image::Image augmented(const image::Image& image, const AugmentationOptions& options,
                       std::uint64_t seed = 0) {
  nn::Random random(seed);
  return augment(image, image.width, image.height, options, random);
}

double mean(const image::Image& image, int channel) {
  double sum = 0;
  for (std::size_t i = static_cast<std::size_t>(channel); i < image.bgr.size(); i += 3) {
    sum += image.bgr[i];
  }
  return 3 * sum / static_cast<double>(image.bgr.size());
}

TEST(Augmentation, NothingChangesNothing) {
  const image::Image image = noise(33, 65);
  EXPECT_EQ(augmented(image, kNothing).bgr, image.bgr);
}

TEST(Augmentation, FlipIsAMirror) {
  const image::Image image = noise(33, 65);
  AugmentationOptions options = kNothing;
  options.flip = 1;
  EXPECT_EQ(augmented(image, options).bgr, flipped(image).bgr);
  EXPECT_NE(flipped(image).bgr, image.bgr);
  EXPECT_EQ(flipped(flipped(image)).bgr, image.bgr);
  options.flip = 0.25;
  int flips = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    flips += augmented(image, options, seed).bgr == image.bgr ? 0 : 1;
  }
  EXPECT_NEAR(flips, 100, 35);
}

TEST(Augmentation, TheBoxMovesWithinItsBounds) {
  // A horizontal ramp: the shift can be read off in the middle.
  image::Image ramp(100, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x)
      std::fill_n(ramp.pixel(x, y), 3, static_cast<std::uint8_t>(2 * x));
  }
  AugmentationOptions options = kNothing;
  options.translate = 0.1;
  double largest = 0;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const double shift = (augmented(ramp, options, seed).pixel(50, 50)[0] - 100) / 2.0;
    largest = std::max(largest, std::abs(shift));
    sum += shift;
  }
  EXPECT_LE(largest, 10.5);
  EXPECT_GT(largest, 9);
  EXPECT_NEAR(sum / 300, 0, 1.5);
  options = kNothing;
  options.scale = 0.2;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const image::Image scaled = augmented(ramp, options, seed);
    const double slope = (scaled.pixel(70, 50)[0] - scaled.pixel(30, 50)[0]) / 80.0;
    EXPECT_GT(slope, 0.77);
    EXPECT_LT(slope, 1.23);
  }
}

TEST(Augmentation, ColoursChangeWithinTheirBounds) {
  const image::Image image = noise(32, 64);
  AugmentationOptions options = kNothing;
  options.brightness = 0.3;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const image::Image changed = augmented(image, options, seed);
    const double gain = mean(changed, 0) / mean(image, 0);
    EXPECT_GT(gain, 1 / 1.3 - 0.01);
    EXPECT_LT(gain, 1.3 + 0.01);
    EXPECT_NEAR(mean(changed, 1) / mean(image, 1), gain, 0.01);
  }
  options = kNothing;
  options.tint = 0.1;
  double difference = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const image::Image changed = augmented(image, options, seed);
    const double blue = mean(changed, 0) / mean(image, 0);
    const double red = mean(changed, 2) / mean(image, 2);
    EXPECT_LT(std::abs(blue - 1), 0.11);
    difference = std::max(difference, std::abs(blue - red));
  }
  EXPECT_GT(difference, 0.05);
  options = kNothing;
  options.grey = 1;
  const image::Image grey = augmented(image, options);
  for (std::size_t i = 0; i < grey.bgr.size(); i += 3) {
    EXPECT_EQ(grey.bgr[i], grey.bgr[i + 1]);
    EXPECT_EQ(grey.bgr[i], grey.bgr[i + 2]);
  }
}

// Sum of absolute differences of neighbours: what blur and a low resolution take away.
double roughness(const image::Image& image) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 1; x < image.width; ++x) {
      sum += std::abs(image.pixel(x, y)[0] - image.pixel(x - 1, y)[0]);
    }
  }
  return sum;
}

TEST(Augmentation, LowResolutionAndBlurSmoothAndKeepTheMean) {
  const image::Image image = noise(64, 128);
  for (double AugmentationOptions::*field :
       {&AugmentationOptions::low_resolution, &AugmentationOptions::blur}) {
    AugmentationOptions options = kNothing;
    options.*field = 1;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const image::Image changed = augmented(image, options, seed);
      EXPECT_LT(roughness(changed), 0.75 * roughness(image));
      EXPECT_NEAR(mean(changed, 0), mean(image, 0), 1.0);
    }
  }
}

TEST(Augmentation, EraseCoversOneRectangle) {
  const image::Image image =
      noise(64, 128, 130, 180);  // no value of the mean colour but the red one
  AugmentationOptions options = kNothing;
  options.erase = 1;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const image::Image changed = augmented(image, options, seed);
    int left = 64, right = 0, top = 128, bottom = 0, count = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 64; ++x) {
        if (changed.pixel(x, y)[0] == image.pixel(x, y)[0]) continue;
        EXPECT_NEAR(changed.pixel(x, y)[0], 103.5, 1);
        left = std::min(left, x);
        right = std::max(right, x);
        top = std::min(top, y);
        bottom = std::max(bottom, y);
        ++count;
      }
    }
    const int width = right - left + 1, height = bottom - top + 1;
    EXPECT_EQ(count, width * height);
    EXPECT_GE(width, 12);
    EXPECT_LE(width, 39);
    EXPECT_GE(height, 12);
    EXPECT_LE(height, 45);
  }
}

TEST(Augmentation, GammaIsAPowerWithinItsBounds) {
  image::Image grey(8, 8);
  std::fill(grey.bgr.begin(), grey.bgr.end(), 64);
  grey.pixel(0, 0)[0] = 0;
  grey.pixel(1, 0)[0] = 255;
  AugmentationOptions options = kNothing;
  options.gamma = 0.5;
  double darkest = 255, brightest = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const image::Image changed = augmented(grey, options, seed);
    EXPECT_EQ(changed.pixel(0, 0)[0], 0);
    EXPECT_EQ(changed.pixel(1, 0)[0], 255);
    darkest = std::min<double>(darkest, changed.pixel(4, 4)[1]);
    brightest = std::max<double>(brightest, changed.pixel(4, 4)[1]);
  }
  EXPECT_NEAR(darkest, 255 * std::pow(64 / 255.0, 1.5), 1);
  EXPECT_NEAR(brightest, 255 * std::pow(64 / 255.0, 1 / 1.5), 1.5);
}

TEST(Augmentation, OffsetMovesAllChannelsAlike) {
  const image::Image image = noise(32, 64, 100, 150);
  AugmentationOptions options = kNothing;
  options.offset = 0.1;
  double largest = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const image::Image changed = augmented(image, options, seed);
    const double shift = mean(changed, 0) - mean(image, 0);
    EXPECT_NEAR(mean(changed, 2) - mean(image, 2), shift, 1.01);
    largest = std::max(largest, std::abs(shift));
  }
  EXPECT_NEAR(largest, 25.5, 2);
}

TEST(Augmentation, NoiseHasItsDeviationAndNoBias) {
  image::Image grey(64, 128);
  std::fill(grey.bgr.begin(), grey.bgr.end(), 128);
  AugmentationOptions options = kNothing;
  options.noise = 10;
  double largest = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const image::Image changed = augmented(grey, options, seed);
    double square = 0;
    for (const auto value : changed.bgr) square += (value - 128.0) * (value - 128.0);
    largest = std::max(largest, std::sqrt(square / static_cast<double>(changed.bgr.size())));
    EXPECT_NEAR(mean(changed, 1), 128, 0.5);
  }
  EXPECT_NEAR(largest, 10, 0.5);
}

TEST(Augmentation, AGreyPatchTakesTheColourOfOneRectangle) {
  image::Image image = noise(64, 128);
  for (std::size_t i = 0; i < image.bgr.size(); i += 3) image.bgr[i] = 10;  // no pixel is grey
  AugmentationOptions options = kNothing;
  options.grey_patch = 1;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const image::Image changed = augmented(image, options, seed);
    int left = 64, right = 0, top = 128, bottom = 0, count = 0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 64; ++x) {
        const std::uint8_t *p = changed.pixel(x, y), *q = image.pixel(x, y);
        if (std::equal(p, p + 3, q)) continue;
        EXPECT_EQ(p[0], p[1]);
        EXPECT_NEAR(p[2], 0.114 * q[0] + 0.587 * q[1] + 0.299 * q[2], 1);
        left = std::min(left, x);
        right = std::max(right, x);
        top = std::min(top, y);
        bottom = std::max(bottom, y);
        ++count;
      }
    }
    EXPECT_EQ(count, (right - left + 1) * (bottom - top + 1));
    EXPECT_GT(count, 100);
  }
}

TEST(Augmentation, ACropLosesAtMostAThirdAboveOrBelow) {
  // Rows tell where they came from.
  image::Image ramp(16, 201);
  for (int y = 0; y < ramp.height; ++y) {
    for (int x = 0; x < ramp.width; ++x) {
      std::fill_n(ramp.pixel(x, y), 3, static_cast<std::uint8_t>(y));
    }
  }
  AugmentationOptions options = kNothing;
  options.crop = 1;
  int first = 0, last = 255;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const image::Image changed = augmented(ramp, options, seed);
    const int top = changed.pixel(8, 0)[0], bottom = changed.pixel(8, 200)[0];
    EXPECT_TRUE(top == 0 || bottom == 200) << top << " " << bottom;
    first = std::max(first, top);
    last = std::min(last, bottom);
  }
  EXPECT_NEAR(first, 67, 3);
  EXPECT_NEAR(last, 133, 3);
}

TEST(Augmentation, TheGeneratorDecides) {
  const image::Image image = noise(40, 90);
  const AugmentationOptions options;
  EXPECT_EQ(augmented(image, options, 3).bgr, augmented(image, options, 3).bgr);
  EXPECT_NE(augmented(image, options, 3).bgr, augmented(image, options, 4).bgr);
}

TEST(Augmentation, TinyImagesWork) {
  const AugmentationOptions all{1, 0.5, 0.5, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 9};
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    nn::Random random(seed);
    const image::Image image = augment(noise(1, 1), 64, 128, all, random);
    EXPECT_EQ(image.bgr.size(), 64u * 128u * 3u);
  }
}

TEST(Augmentation, OptionsAreChecked) {
  TrainerOptions options;
  EXPECT_NO_THROW(options.validate());
  options.augmentation.erase = 1.5;
  try {
    options.validate();
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("erase is 1.5"));
  }
  options = {};
  options.augmentation.scale = std::nan("");
  EXPECT_THROW(options.validate(), std::invalid_argument);
  options = {};
  options.augmentation.flip = -0.1;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::train
