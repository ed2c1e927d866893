// SPDX-License-Identifier: Apache-2.0
// What the tracker's tracks count beside what the ground truth counts; skipped where the data is
// not there.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>

#include "sdmt/mot/mot_file.h"
#include "sdmt/track/tracker.h"
#include "sdmt/zones/zone_counter.h"

namespace sdmt::zones {
namespace {

constexpr double kFrameRate = 7;

ZonePlan plan() {
  return parse_zone_plan(R"({"picture": [768, 576],
      "lines": [{"name": "road", "from": [50, 280], "to": [740, 280]},
                {"name": "lamp", "from": [350, 120], "to": [350, 560]}],
      "areas": [{"name": "crossing",
                 "corners": [[300, 200], [620, 200], [620, 420], [300, 420]]}]})",
                         "plan");
}

TEST(CountsOnData, TracksCountAsTheGroundTruthDoes) {
  const std::filesystem::path folder =
      std::filesystem::path(SDMT_DATA_DIR) / "mot15" / "PETS09-S2L1";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";

  std::map<int, track::FinishedFrame> frames;
  for (const auto& row : mot::read_ground_truth(folder / "gt" / "gt.txt")) {
    frames[row.frame].frame = row.frame;
    frames[row.frame].boxes.push_back({.id = row.id, .box = row.box});
  }
  ZoneCounter truth(plan());
  for (const auto& [number, frame] : frames) truth.add(frame, number / kFrameRate);
  truth.finish();

  ZoneCounter counted(plan());
  const auto add = [&](const std::vector<track::FinishedFrame>& finished) {
    for (const auto& frame : finished) counted.add(frame, frame.frame / kFrameRate);
  };
  track::Tracker tracker;
  const auto detections = mot::DetectionFile::read(folder / "det" / "det.txt");
  for (int frame = 1; frame <= 795; ++frame) add(tracker.update(detections.frame(frame)));
  add(tracker.finish());
  counted.finish();

  for (std::size_t i = 0; i < truth.lines().size(); ++i) {
    const LineCounts right = truth.lines()[i], ours = counted.lines()[i];
    RecordProperty(truth.plan().lines[i].name,
                   std::to_string(ours.in) + " in, " + std::to_string(ours.out) + " out");
    EXPECT_GE(right.in + right.out, 10);
    EXPECT_LE(std::abs(ours.in - right.in), 2) << truth.plan().lines[i].name << " in";
    EXPECT_LE(std::abs(ours.out - right.out), 2) << truth.plan().lines[i].name << " out";
  }
  const AreaCounts right = truth.areas()[0], ours = counted.areas()[0];
  EXPECT_GE(right.stays, 10);
  // Somebody who was hidden may come back as another: then a stay is counted as two.
  EXPECT_GE(ours.stays, right.stays - 1);
  EXPECT_LE(ours.stays, right.stays + right.stays / 3);
  EXPECT_NEAR(ours.dwell, right.dwell, 0.1 * right.dwell);
  EXPECT_LE(std::abs(ours.most_inside - right.most_inside), 1);
}

}  // namespace
}  // namespace sdmt::zones
