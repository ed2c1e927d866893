// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

namespace sdmt::nn {
namespace {

TEST(Random, MatchesThePublishedGenerator) {
  // First outputs of xoshiro256** for the state {1, 2, 3, 4}, as in the test vectors of the Rust
  // crate rand_xoshiro (which took them from the reference C code).
  Random random;
  random.set_state({1, 2, 3, 4});
  const std::array<std::uint64_t, 4> expected = {11520, 0, 1509978240, 1215971899390074240ULL};
  for (const auto value : expected) EXPECT_EQ(random.next(), value);
}

TEST(Random, SameSeedSameNumbersOtherStreamOtherNumbers) {
  Random a(7), b(7), c(7, 1);
  bool differs = false;
  for (int i = 0; i < 100; ++i) {
    const auto value = a.next();
    EXPECT_EQ(value, b.next());
    differs |= value != c.next();
  }
  EXPECT_TRUE(differs);
}

TEST(Random, BelowIsUniform) {
  Random random(1);
  std::array<int, 7> counts{};
  for (int i = 0; i < 70000; ++i) ++counts[random.below(7)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);
}

TEST(Random, NormalHasTheRightMoments) {
  Random random(2);
  double sum = 0, squares = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.01);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.01);
}

TEST(Random, ShuffleIsAPermutation) {
  Random random(3);
  std::vector<int> values(100);
  std::iota(values.begin(), values.end(), 0);
  random.shuffle(std::span<int>(values));
  EXPECT_NE(values[0] * 100 + values[1], 1);
  std::vector<int> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(sorted[static_cast<std::size_t>(i)], i);
}

}  // namespace
}  // namespace sdmt::nn
