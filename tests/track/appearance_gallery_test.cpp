// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/appearance_gallery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::track {
namespace {

using ::testing::ElementsAre;

// States that carry their number, so that one can see which were kept.
AppearanceGallery numbered(int count, int capacity, int first = 0) {
  AppearanceGallery gallery(capacity);
  for (int i = 0; i < count; ++i) {
    gallery.add(std::vector<float>{static_cast<float>(first + i), 1});
  }
  return gallery;
}

std::vector<int> numbers(const AppearanceGallery& gallery) {
  std::vector<int> kept;
  for (std::size_t i = 0; i < gallery.size(); ++i) {
    kept.push_back(static_cast<int>(gallery.state(i)[0]));
  }
  return kept;
}

TEST(AppearanceGallery, KeepsAllWhileTheyFit) {
  EXPECT_TRUE(numbered(0, 5).empty());
  EXPECT_THAT(numbers(numbered(3, 5)), ElementsAre(0, 1, 2));
  EXPECT_THAT(numbers(numbered(5, 5)), ElementsAre(0, 1, 2, 3, 4));
}

TEST(AppearanceGallery, SpreadsEvenlyFromTheFirstToTheLatest) {
  EXPECT_THAT(numbers(numbered(9, 5)), ElementsAre(0, 2, 4, 6, 8));
  EXPECT_THAT(numbers(numbered(10, 4)), ElementsAre(0, 4, 6, 9));  // beyond 2 N: within one step
  EXPECT_THAT(numbers(numbered(7, 1)), ElementsAre(6));
}

TEST(AppearanceGallery, StaysBoundedAndEvenForEver) {
  constexpr int kCapacity = 20;
  AppearanceGallery gallery(kCapacity);
  for (int count = 1; count <= 20000; ++count) {
    gallery.add(std::vector<float>{static_cast<float>(count - 1), 1});
    const auto kept = numbers(gallery);
    ASSERT_EQ(kept.size(), static_cast<std::size_t>(std::min(count, kCapacity)));
    ASSERT_EQ(kept.front(), 0);
    ASSERT_EQ(kept.back(), count - 1);
    const double step = static_cast<double>(count - 1) / (kCapacity - 1);
    for (std::size_t i = 1; i < kept.size(); ++i) {
      ASSERT_GT(kept[i], kept[i - 1]) << count;
      ASSERT_LE(kept[i] - kept[i - 1], 2.1 * step + 1) << count;
    }
  }
}

TEST(AppearanceGallery, JoinsAnOlderPart) {
  AppearanceGallery newer = numbered(4, 5, 10);
  newer.prepend(numbered(3, 5));
  EXPECT_THAT(numbers(newer), ElementsAre(0, 2, 10, 12, 13));
  newer.add(std::vector<float>{14, 1});
  EXPECT_EQ(numbers(newer).back(), 14);

  AppearanceGallery empty(5);
  empty.prepend(numbered(3, 5));
  EXPECT_THAT(numbers(empty), ElementsAre(0, 1, 2));
  empty.prepend(AppearanceGallery(5));
  EXPECT_THAT(numbers(empty), ElementsAre(0, 1, 2));
}

TEST(AppearanceGallery, MeasuresDistancesAsWritten) {
  nn::Random random(3);
  std::vector<std::vector<float>> a(4), b(3);
  AppearanceGallery first(20), second(20);
  const auto fill = [&](std::vector<std::vector<float>>& vectors, AppearanceGallery& gallery) {
    for (auto& vector : vectors) {
      for (int i = 0; i < 37; ++i) vector.push_back(static_cast<float>(random.normal()));
      gallery.add(vector);
    }
  };
  fill(a, first);
  fill(b, second);
  double sum = 0, nearest = 1e9, sum_to_first = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      double squared = 0;
      for (std::size_t k = 0; k < 37; ++k) {
        squared += std::pow(static_cast<double>(a[i][k]) - static_cast<double>(b[j][k]), 2);
      }
      sum += std::sqrt(squared);
      nearest = std::min(nearest, std::sqrt(squared));
      if (j == 0) sum_to_first += std::sqrt(squared);
    }
  }
  EXPECT_NEAR(first.distance(second, GalleryDistance::mean), sum / 12, 1e-5);
  EXPECT_NEAR(first.distance(second, GalleryDistance::nearest), nearest, 1e-5);
  EXPECT_NEAR(first.distance(b[0], GalleryDistance::mean), sum_to_first / 4, 1e-5);
  EXPECT_EQ(euclidean_distance(a[0], a[0]), 0.0);
}

}  // namespace
}  // namespace sdmt::track
