// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/plausibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace sdmt::mot {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 640, kHeight = 480;

// People all over the picture, some cut off by its edges as detectors give them.
std::vector<Tlwh> people(int count = 300) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(-10, 600), y(-10, 400), height(40, 200);
  std::vector<Tlwh> boxes;
  for (int i = 0; i < count; ++i) {
    const double left = x(random), top = y(random), tall = height(random);
    boxes.push_back({left, top, 0.4 * tall, tall});
  }
  return boxes;
}

// The same within the picture, as most detectors clip them.
std::vector<Tlwh> clipped_people() {
  auto boxes = people();
  for (Tlwh& box : boxes) {
    const double right = std::min(box.left + box.width, kWidth + 1.0);
    const double bottom = std::min(box.top + box.height, kHeight + 1.0);
    box.left = std::max(box.left, 1.0);
    box.top = std::max(box.top, 1.0);
    box.width = right - box.left;
    box.height = bottom - box.top;
  }
  return boxes;
}

template <typename Change>
std::string described(Change change, int width = kWidth, int height = kHeight) {
  auto boxes = clipped_people();
  for (Tlwh& box : boxes) change(box);
  return describe_implausible(boxes, width, height);
}

TEST(Plausibility, RealBoxesAreNotDoubted) {
  EXPECT_EQ(describe_implausible(people(), kWidth, kHeight), "");
  EXPECT_EQ(describe_implausible(people(), 0, 0), "");
  EXPECT_EQ(describe_implausible(clipped_people(), kWidth, kHeight), "");
  EXPECT_EQ(describe_implausible(people(3), kWidth, kHeight), "");
  EXPECT_EQ(describe_implausible(std::vector<Tlwh>{}, kWidth, kHeight), "");
}

TEST(Plausibility, SomebodyAtTheBorderMakesNoCentres) {
  auto boxes = clipped_people();
  std::erase_if(boxes, [](const Tlwh& b) { return b.left < 60 || b.top < 120; });
  for (int frame = 0; frame < 20; ++frame)
    boxes.push_back({kWidth - 12 - 0.1 * frame, 200, 20, 50});
  EXPECT_EQ(describe_implausible(boxes, kWidth, kHeight), "");
}

TEST(Plausibility, KnowsFractions) {
  const auto shrink = [](Tlwh& b) {
    b = {b.left / kWidth, b.top / kHeight, b.width / kWidth, b.height / kHeight};
  };
  EXPECT_THAT(described(shrink), HasSubstr("within 0..1"));
  EXPECT_THAT(described(shrink, 0, 0), HasSubstr("within 0..1"));
}

TEST(Plausibility, KnowsPercent) {
  EXPECT_THAT(described([](Tlwh& b) {
                b = {100 * b.left / kWidth, 100 * b.top / kHeight, 100 * b.width / kWidth,
                     100 * b.height / kHeight};
              }),
              HasSubstr("within 0..100"));
}

TEST(Plausibility, KnowsWidthsThatAreHeights) {
  EXPECT_THAT(described([](Tlwh& b) { std::swap(b.width, b.height); }, 2 * kWidth, 2 * kHeight),
              HasSubstr("wider than tall"));
}

TEST(Plausibility, KnowsTwoCorners) {
  const auto corners = [](Tlwh& b) { b = {b.left, b.top, b.left + b.width, b.top + b.height}; };
  EXPECT_THAT(described(corners), HasSubstr("two corners"));
  EXPECT_THAT(described(corners, 0, 0), HasSubstr("two corners"));
}

TEST(Plausibility, KnowsCentres) {
  EXPECT_THAT(described([](Tlwh& b) {
                b.left += b.width / 2;
                b.top += b.height / 2;
              }),
              HasSubstr("centres"));
}

TEST(Plausibility, KnowsBoxesOfAnotherPicture) {
  const auto scale = [](double factor) {
    return [factor](Tlwh& b) {
      b = {b.left * factor, b.top * factor, b.width * factor, b.height * factor};
    };
  };
  EXPECT_THAT(described(scale(2)), HasSubstr("outside the picture"));
  EXPECT_THAT(described(scale(3)), HasSubstr("the picture is 640 x 480"));
  EXPECT_THAT(described(scale(0.5)), HasSubstr("made for a smaller one"));
}

}  // namespace
}  // namespace sdmt::mot
