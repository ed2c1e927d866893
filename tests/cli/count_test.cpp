// SPDX-License-Identifier: Apache-2.0
// Counting people, while tracking and afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "cli/track_scene.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;

class Count : public TrackScene {
 protected:
  std::string zones(const std::string& text) {
    write_file(folder_ / "zones.json", text);
    return folder_ / "zones.json";
  }
  std::vector<nlohmann::json> lines(const std::string& name) {
    std::vector<nlohmann::json> result;
    std::istringstream text(read_file(folder_ / name));
    for (std::string line; std::getline(text, line);) {
      result.push_back(nlohmann::json::parse(line));
    }
    return result;
  }
};

// Upright in the way of people who walk to the right, whose "in" is to the left.
const char* const kGate =
    R"({"picture": [1000, 500], "lines": [{"name": "gate", "from": [80, 1], "to": [80, 500]}]})";

TEST_F(Count, WhileTrackingAndFromItsRowsIsTheSame) {
  const auto scene = picture_sequence("scene", 150);
  const auto plan = zones(R"({"lines": [{"name": "a", "from": [1, 110], "to": [320, 110]}],
      "areas": [{"name": "b, c", "corners": [[60, 60], [260, 60], [260, 150], [60, 150]]}]})");
  const auto tracked =
      track(scene, {"--no-appearance", "--zones", plan, "--events", folder_ / "e.jsonl", "--counts",
                    folder_ / "c.csv", "--heat-map", folder_ / "h.png"});
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  const auto counted = run_sdmt({"count", folder_ / "tracks.txt", "--zones", plan, "--gt", scene,
                                 "--events", folder_ / "e2.jsonl", "--counts", folder_ / "c2.csv"});
  ASSERT_EQ(counted.exit_code, 0) << counted.err;
  EXPECT_EQ(read_file(folder_ / "c.csv"), read_file(folder_ / "c2.csv"));
  EXPECT_THAT(read_file(folder_ / "c.csv"), HasSubstr("\n\"b, c\",area,all,,,"));
  EXPECT_THAT(counted.out, HasSubstr("b, c"));
  // Rows are rounded to hundredths of a pixel, events may shift by it; none is lost.
  EXPECT_EQ(lines("e.jsonl").size(), lines("e2.jsonl").size());
  EXPECT_GT(lines("e.jsonl").size(), 4u);

  const cv::Mat heat = cv::imread(folder_ / "h.png");
  EXPECT_EQ(heat.size(), cv::Size(320, 180));
}

TEST_F(Count, PeopleWhoWalkThroughAGate) {
  const auto sequence = motion_sequence("walkers", 120, 3);
  const auto result = track(
      sequence, {"--no-appearance", "--zones", zones(kGate), "--events", folder_ / "e.jsonl"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::set<int> people;
  for (const auto& event : lines("e.jsonl")) {
    EXPECT_EQ(event["event"], "out");
    EXPECT_EQ(event["zone"], "gate");
    people.insert(event["id"].get<int>());
  }
  EXPECT_EQ(people.size(), lines("e.jsonl").size());  // each once
  EXPECT_EQ(people.size(), 3u);
}

TEST_F(Count, SaysWhatIsMissing) {
  const auto sequence = motion_sequence("walkers", 20, 1);
  auto result = track(sequence, {"--no-appearance", "--events", folder_ / "e.jsonl"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--zones"));

  result = track(sequence, {"--no-appearance", "--zones", zones(R"({"lines": []})")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("zones.json: no zone"));
  EXPECT_FALSE(has_tracks());

  write_file(folder_ / "rows.txt", "1,1,10,10,20,40,1,-1,-1,-1\n");
  result = run_sdmt({"count", folder_ / "rows.txt", "--zones", zones(kGate)});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("give --frame-rate"));
  result = run_sdmt({"count", folder_ / "rows.txt", "--zones", zones(kGate), "--frame-rate", "25"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("gate"));
}

}  // namespace
}  // namespace sdmt::tests
