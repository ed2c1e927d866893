// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/sort_baseline.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

namespace sdmt::track {
namespace {

std::vector<mot::Detection> at(double left) { return {{{left, 50, 40, 90}, 1}}; }

TEST(SortTracker, ReportsFromTheFirstFramesAndEndsAfterTwoMisses) {
  SortTracker tracker;
  for (int frame = 1; frame <= 10; ++frame) {
    const auto finished = tracker.update(at(10.0 + 2 * frame));
    EXPECT_EQ(finished.frame, frame);
    ASSERT_EQ(finished.boxes.size(), 1u) << frame;
    EXPECT_EQ(finished.boxes[0].id, 1);
    EXPECT_NEAR(finished.boxes[0].box.left, 10.0 + 2 * frame, 1.0);
  }
  EXPECT_TRUE(tracker.update({}).boxes.empty());
  // One miss: the track lives on, but must collect three hits in a row to be reported again.
  EXPECT_TRUE(tracker.update(at(34)).boxes.empty());
  EXPECT_TRUE(tracker.update(at(36)).boxes.empty());
  const auto again = tracker.update(at(38));
  ASSERT_EQ(again.boxes.size(), 1u);
  EXPECT_EQ(again.boxes[0].id, 1);
  // Two misses end it; a new track is reported from its third detection after the first.
  tracker.update({});
  tracker.update({});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(tracker.update(at(40)).boxes.empty());
  const auto reborn = tracker.update(at(40));
  ASSERT_EQ(reborn.boxes.size(), 1u);
  EXPECT_EQ(reborn.boxes[0].id, 2);
}

TEST(SortTracker, SwallowsHostileBoxesAndRefusesImpossibleOnes) {
  SortTracker tracker;
  const double sizes[] = {1e-9, 1e9, 1, 1e-3, 1e7};
  for (int frame = 0; frame < 200; ++frame) {
    const double size = sizes[frame % 5];
    for (const auto& box :
         tracker.update(std::vector<mot::Detection>{{{-1e9, 1e9, size, 5}, 1}}).boxes) {
      EXPECT_TRUE(box.box.width == box.box.width);
    }
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tracker.update(std::vector<mot::Detection>{{{0, 0, 0, 5}, 1}}),
               std::invalid_argument);
  EXPECT_THROW(tracker.update(std::vector<mot::Detection>{{{nan, 0, 1, 5}, 1}}),
               std::invalid_argument);
  EXPECT_THROW(SortTracker({-1, 3, 0.3}), std::invalid_argument);
  EXPECT_THROW(SortTracker({1, -3, 0.3}), std::invalid_argument);
  EXPECT_THROW(SortTracker({1, 3, 1.3}), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::track
