// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/bytetrack_baseline.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

namespace sdmt::track {
namespace {

std::vector<mot::Detection> at(double left, double score) { return {{{left, 50, 40, 90}, score}}; }

TEST(ByteTracker, StartsFromStrongDetectionsGoesOnWithWeakOnesAndRemembers) {
  ByteTracker tracker;
  EXPECT_EQ(tracker.update(at(10, 0.9)).boxes.size(), 1u);  // at once in the first frame
  EXPECT_EQ(tracker.update(at(12, 0.3)).boxes.size(), 1u);  // weak
  EXPECT_EQ(tracker.update(at(14, 0.1)).boxes.size(), 0u);  // not above the lowest threshold
  for (int frame = 4; frame <= 32; ++frame) EXPECT_TRUE(tracker.update({}).boxes.empty());
  const auto again = tracker.update(at(74, 0.65));  // frame 33, 31 after the latest detection
  EXPECT_TRUE(again.boxes.empty());

  ByteTracker other;
  other.update(at(10, 0.9));
  for (int frame = 2; frame <= 30; ++frame) other.update({});
  const auto found = other.update(at(10, 0.65));  // 30 after: still the same
  ASSERT_EQ(found.boxes.size(), 1u);
  EXPECT_EQ(found.boxes[0].id, 1);
}

TEST(ByteTracker, LaterTracksNeedTwoDetectionsInARow) {
  ByteTracker tracker;
  tracker.update({});
  EXPECT_TRUE(tracker.update(at(10, 0.9)).boxes.empty());
  EXPECT_TRUE(tracker.update({}).boxes.empty());  // forgotten
  EXPECT_TRUE(tracker.update(at(10, 0.9)).boxes.empty());
  const auto confirmed = tracker.update(at(10, 0.9));
  ASSERT_EQ(confirmed.boxes.size(), 1u);
  EXPECT_EQ(confirmed.boxes[0].id, 2);
  // A detection that is strong, but by less than the margin, starts none.
  ByteTracker hesitant;
  hesitant.update({});
  for (int frame = 0; frame < 5; ++frame) {
    EXPECT_TRUE(hesitant.update(at(10, 0.65)).boxes.empty());
  }
}

TEST(ByteTracker, RefusesImpossibleBoxesAndOptions) {
  ByteTracker tracker;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(tracker.update(std::vector<mot::Detection>{{{0, 0, 0, 5}, 1}}),
               std::invalid_argument);
  EXPECT_THROW(tracker.update(std::vector<mot::Detection>{{{nan, 0, 1, 5}, 1}}),
               std::invalid_argument);
  EXPECT_THROW(ByteTracker({.track_threshold = 1.1}), std::invalid_argument);
  EXPECT_THROW(ByteTracker({.max_lost = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::track
