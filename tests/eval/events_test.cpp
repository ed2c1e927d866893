// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/events.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace sdmt::eval {
namespace {

using mot::Tlwh;

// Person 1 walks through frames 1..40 and is followed by result 10 up to frame 10, missed for 20
// frames, then followed by result 11. Result 99 stands where nobody is in frames 5..9.
struct Scene {
  PreparedSequence prepared;
  ClearMatches matches;

  Scene() {
    GroundTruth gt{"S", "gt.txt", 40, true, {}};
    std::vector<mot::ResultRow> results;
    for (int t = 1; t <= 40; ++t) {
      const Tlwh box{10.0 * t, 50, 40, 80};
      gt.rows.push_back({t, 1, box, true, kPedestrian, 1.0});
      if (t <= 10 || t > 30) results.push_back({t, t <= 10 ? 10 : 11, box, 1.0, -1});
      if (t >= 5 && t <= 9) results.push_back({t, 99, Tlwh{900, 500, 40, 80}, 1.0, -1});
    }
    prepared = prepare_sequence(gt, results, "S.txt", Benchmark::mot16, Compat::trackeval);
    clear_mot(prepared.similarities, Compat::trackeval, &matches);
  }
};

TEST(Events, SwitchMissAndFalseTrack) {
  const Scene scene;
  const auto events = find_events(scene.prepared, scene.matches, {.long_miss = 20});
  ASSERT_EQ(events.size(), 3U);

  EXPECT_EQ(events[0].kind, EventKind::false_track);
  EXPECT_EQ(events[0].result_id, 99);
  EXPECT_EQ(events[0].gt_id, -1);
  EXPECT_EQ(events[0].first_frame, 5);
  EXPECT_EQ(events[0].last_frame, 9);
  EXPECT_EQ(events[0].boxes, 5);
  EXPECT_EQ(events[0].track_boxes, 5);
  EXPECT_EQ(events[0].box, (Tlwh{900, 500, 40, 80}));

  EXPECT_EQ(events[1].kind, EventKind::long_miss);
  EXPECT_EQ(events[1].gt_id, 1);
  EXPECT_EQ(events[1].first_frame, 11);
  EXPECT_EQ(events[1].last_frame, 30);
  EXPECT_EQ(events[1].boxes, 20);
  EXPECT_EQ(events[1].track_boxes, 40);
  EXPECT_EQ(events[1].box, (Tlwh{110, 50, 40, 80}));

  EXPECT_EQ(events[2].kind, EventKind::id_switch);
  EXPECT_EQ(events[2].first_frame, 31);
  EXPECT_EQ(events[2].previous_result_id, 10);
  EXPECT_EQ(events[2].result_id, 11);
  EXPECT_EQ(events[2].boxes, 21);
  EXPECT_FALSE(events[2].after_absence);
}

TEST(Events, ThresholdsDecide) {
  const Scene scene;
  EXPECT_EQ(find_events(scene.prepared, scene.matches, {.long_miss = 21}).size(), 2U);
  EXPECT_EQ(
      find_events(scene.prepared, scene.matches, {.long_miss = 21, .false_track_match = 0}).size(),
      1U);
}

TEST(Events, AMissThatLastsToTheEndIsReported) {
  GroundTruth gt{"S", "gt.txt", 9, true, {}};
  for (int t = 1; t <= 9; ++t) gt.rows.push_back({t, 3, Tlwh{5, 5, 10, 20}, true, 1, 1.0});
  const auto prepared =
      prepare_sequence(gt, std::vector<mot::ResultRow>{{1, 1, {5, 5, 10, 20}, 1.0, -1}}, "S.txt",
                       Benchmark::mot16, Compat::trackeval);
  ClearMatches matches;
  clear_mot(prepared.similarities, Compat::trackeval, &matches);
  const auto events = find_events(prepared, matches, {.long_miss = 8});
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].first_frame, 2);
  EXPECT_EQ(events[0].last_frame, 9);
}

TEST(Events, OptionsAreChecked) {
  EXPECT_THROW(EventOptions{.long_miss = 0}.validate(), std::invalid_argument);
  EXPECT_THROW(EventOptions{.false_track_match = 1.5}.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::eval
