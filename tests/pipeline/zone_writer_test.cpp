// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/zone_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "cli/run_command.h"

namespace sdmt::pipeline {
namespace {

using testing::HasSubstr;

constexpr const char* kPlan =
    R"({"picture": [100, 100], "lines": [{"name": "door", "from": [50, 1], "to": [50, 100]}]})";

// Somebody who walks to the right, over the line in the middle, 10 pixels a frame.
track::FinishedFrame walker(int frame, int first = 1) {
  track::FinishedFrame finished;
  finished.frame = frame;
  finished.boxes.push_back({.id = 1, .box = {10.0 * (frame - first), 20, 10, 40}, .score = 0.9});
  return finished;
}

class ZoneWriters : public testing::Test {
 protected:
  ZoneWriters() { tests::write_file(folder_ / "plan.json", kPlan); }
  zones::ZonePlan plan() const { return zones::read_zone_plan(folder_ / "plan.json"); }

  tests::TemporaryFolder folder_;
  ZoneFiles files_{folder_ / "events.jsonl", folder_ / "counts.csv", ""};
};

TEST_F(ZoneWriters, OfACameraCountByTheHoursOfTheClock) {
  // 2026-03-01T14:59:59Z, a second before the hour.
  const std::chrono::system_clock::time_point start(std::chrono::seconds(1772377199));
  ZoneWriter writer(plan(), files_, Flowing{{}, [](const std::string& text) { FAIL() << text; }});
  for (int i = 0; i < 10; ++i) {
    const std::chrono::milliseconds after(250 * i);
    writer.write(walker(i + 1), {.time = 0.25 * i, .wall_clock = start + after});
  }
  const std::string events = tests::read_file(folder_ / "events.jsonl");  // before the end
  EXPECT_THAT(events, HasSubstr("\"zone\":\"door\",\"id\":1,\"frame\":"));
  EXPECT_THAT(events, testing::ContainsRegex(
                          "\"time\":1\\.[0-9]+,\"utc\":\"2026-03-01T15:00:00\\.[0-9]*Z\""));
  writer.commit();
  EXPECT_THAT(tests::read_file(folder_ / "counts.csv"), HasSubstr("door,line,2026-03-01T15Z,"));
}

TEST_F(ZoneWriters, OfAFileCountFromItsFirstFrame) {
  ZoneWriter writer(plan(), files_);
  for (int i = 0; i < 10; ++i) writer.write(walker(i + 1), {.time = 0.25 * i});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "events.jsonl"));  // whole or not at all
  writer.commit();
  EXPECT_THAT(tests::read_file(folder_ / "events.jsonl"), testing::Not(HasSubstr("utc")));
  EXPECT_THAT(tests::read_file(folder_ / "counts.csv"), HasSubstr("door,line,0,"));
}

TEST_F(ZoneWriters, OfACameraFollowTheSizeOfItsPictures) {
  std::vector<std::string> told;
  ZoneWriter writer(plan().in_picture(100, 100), files_,
                    Flowing{{}, [&](const std::string& text) { told.push_back(text); }});
  image::PictureSize size{100, 100};
  writer.follow(
      folder_ / "plan.json", [&] { return size; },
      [&] { return plan().in_picture(size.width, size.height); });
  writer.write(walker(1), {.time = 0});
  EXPECT_TRUE(told.empty());
  size = {200, 200};
  std::this_thread::sleep_for(std::chrono::milliseconds(1050));  // it looks once a second
  writer.write(walker(2), {.time = 0.25});
  EXPECT_THAT(told, testing::ElementsAre(HasSubstr("is read again")));
  EXPECT_EQ(writer.counter().plan().lines[0].from.x, 99);
}

TEST_F(ZoneWriters, NeedTimes) {
  ZoneWriter writer(plan(), files_);
  EXPECT_THROW(writer.write(walker(1), {}), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::pipeline
