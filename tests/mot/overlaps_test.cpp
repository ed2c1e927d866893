// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/overlaps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::mot {
namespace {

using ::testing::ElementsAre;

std::vector<Tlwh> random_boxes(nn::Random& random, int count) {
  std::vector<Tlwh> boxes;
  for (int i = 0; i < count; ++i) {
    // Some on a grid, so that edges touch, some far too wide.
    const double width = random.uniform() < 0.1 ? 500 : 10 * std::ceil(random.uniform(0, 8));
    boxes.push_back({std::floor(random.uniform(-5, 40)) * 10,
                     std::floor(random.uniform(-5, 20)) * 10, width,
                     10 * std::ceil(random.uniform(0, 12))});
  }
  return boxes;
}

TEST(OverlapFinder, FindsWhatComparingAllPairsFinds) {
  nn::Random random(5);
  OverlapFinder finder;
  for (int round = 0; round < 300; ++round) {
    const auto a = random_boxes(random, static_cast<int>(random.below(30)));
    const auto b = random_boxes(random, static_cast<int>(random.below(30)));
    const double bound = round % 3 == 0 ? 0 : random.uniform();
    const auto& found = finder.find(a, b, bound);
    std::size_t next = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        if (!(iou(a[i], b[j]) > bound)) continue;
        ASSERT_LT(next, found.size());
        EXPECT_EQ(found[next].a, static_cast<int>(i));
        EXPECT_EQ(found[next].b, static_cast<int>(j));
        EXPECT_EQ(found[next].iou, iou(a[i], b[j]));
        ++next;
      }
    }
    EXPECT_EQ(next, found.size());
  }
}

std::vector<std::uint8_t> plain_suppression(const std::vector<Tlwh>& boxes,
                                            const std::vector<double>& scores, double max_iou) {
  std::vector<std::uint8_t> keep(boxes.size(), 2);  // 2: not decided
  for (std::size_t round = 0; round < boxes.size(); ++round) {
    std::size_t best = boxes.size();
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (keep[i] == 2 && (best == boxes.size() || scores[i] > scores[best])) best = i;
    }
    keep[best] = 1;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      if (keep[i] == 1 && i != best && iou(boxes[i], boxes[best]) > max_iou) keep[best] = 0;
    }
  }
  return keep;
}

TEST(SuppressOverlaps, AgreesWithThePlainLoop) {
  nn::Random random(6);
  OverlapFinder finder;
  std::vector<std::uint8_t> keep;
  for (int round = 0; round < 300; ++round) {
    const auto boxes = random_boxes(random, static_cast<int>(random.below(40)));
    std::vector<double> scores;
    for (std::size_t i = 0; i < boxes.size(); ++i)
      scores.push_back(std::floor(random.uniform(0, 9)));
    const double max_iou = random.uniform(0, 0.9);
    suppress_overlaps(boxes, scores, max_iou, finder, keep);
    EXPECT_EQ(keep, plain_suppression(boxes, scores, max_iou));
  }
}

TEST(SuppressOverlaps, IsStrictAndCanBeSwitchedOff) {
  const std::vector<Tlwh> boxes = {{0, 0, 10, 10}, {0, 0, 10, 20}, {0, 0, 10, 10}};
  const std::vector<double> scores = {2, 1, 2};
  OverlapFinder finder;
  std::vector<std::uint8_t> keep;
  suppress_overlaps(boxes, scores, 0.5, finder, keep);  // IoU of the first two is 0.5
  EXPECT_THAT(keep, ElementsAre(1, 1, 0));
  suppress_overlaps(boxes, scores, 0.49, finder, keep);
  EXPECT_THAT(keep, ElementsAre(1, 0, 0));
  suppress_overlaps(boxes, scores, 1, finder, keep);
  EXPECT_THAT(keep, ElementsAre(1, 1, 1));
}

}  // namespace
}  // namespace sdmt::mot
