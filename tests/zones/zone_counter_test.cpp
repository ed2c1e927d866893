// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/zone_counter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "sdmt/nn/random.h"
#include "sdmt/zones/counts_table.h"
#include "sdmt/zones/event_lines.h"

namespace sdmt::zones {
namespace {

const Line kDoor{"door", {100, 200}, {300, 200}};
const Area kHall{"hall", {{100, 100}, {300, 100}, {300, 300}, {100, 300}}};

ZonePlan plan(std::vector<Line> lines, std::vector<Area> areas) {
  ZonePlan result;
  result.lines = std::move(lines);
  result.areas = std::move(areas);
  return result;
}

constexpr double kHeight = 100;  // of every box here

track::TrackedBox standing_at(int id, Point foot) {
  return {.id = id, .box = {foot.x - 20, foot.y - kHeight, 40, kHeight}};
}

// Feeds a counter frame by frame, ten in a second.
struct Clock {
  ZoneCounter counter;
  int frame = 0;
  std::vector<ZoneEvent> events;

  explicit Clock(const ZonePlan& zones, ZoneCounterOptions options = {})
      : counter(zones, options) {}

  double time() const { return frame / 10.0; }
  void add(std::vector<track::TrackedBox> boxes, std::vector<track::IdMerge> merges = {}) {
    ++frame;
    const auto& told = counter.add({frame, std::move(boxes), std::move(merges)}, time());
    events.insert(events.end(), told.begin(), told.end());
  }
  void walk(int id, Point from, Point to, int steps) {
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      add({standing_at(id, {from.x + t * (to.x - from.x), from.y + t * (to.y - from.y)})});
    }
  }
  void nobody(int frames) {
    for (int i = 0; i < frames; ++i) add({});
  }
  void finish() {
    const auto& told = counter.finish();
    events.insert(events.end(), told.begin(), told.end());
  }
};

TEST(ZoneCounter, InIsToTheRightHand) {
  Clock down(plan({kDoor}, {}));
  down.walk(1, {200, 100}, {200, 300}, 20);
  EXPECT_EQ(down.counter.lines()[0].in, 1);
  EXPECT_EQ(down.counter.lines()[0].out, 0);
  ASSERT_EQ(down.events.size(), 1u);
  EXPECT_EQ(down.events[0].kind, EventKind::in);
  EXPECT_EQ(down.events[0].zone, "door");
  EXPECT_EQ(down.events[0].frame, 11);  // on the line, which is on its "in" side
  EXPECT_TRUE(down.events[0].witnessed);

  Clock up(plan({kDoor}, {}));
  up.walk(1, {200, 300}, {200, 100}, 20);
  EXPECT_EQ(up.counter.lines()[0].in, 0);
  EXPECT_EQ(up.counter.lines()[0].out, 1);
}

TEST(ZoneCounter, GoingAroundTheEndOfALineIsNoCrossing) {
  Clock clock(plan({kDoor}, {}));
  clock.walk(1, {200, 100}, {400, 100}, 20);
  clock.walk(1, {400, 100}, {400, 300}, 20);
  clock.walk(1, {400, 300}, {200, 300}, 20);
  EXPECT_TRUE(clock.events.empty());
  clock.walk(1, {200, 300}, {200, 100}, 20);  // and back through it
  EXPECT_EQ(clock.counter.lines()[0].out, 1);
}

TEST(ZoneCounter, StandingOnALineIsNoCrossing) {
  nn::Random random(1);
  Clock clock(plan({kDoor}, {}));
  clock.walk(1, {200, 100}, {200, 198}, 10);
  for (int i = 0; i < 500; ++i) {  // within the margin of 5 pixels
    clock.add({standing_at(1, {200, 200 + random.uniform(-4.5, 4.5)})});
  }
  EXPECT_TRUE(clock.events.empty());
  clock.walk(1, {200, 200}, {200, 300}, 10);
  EXPECT_EQ(clock.counter.lines()[0].in, 1);
  EXPECT_EQ(clock.counter.lines()[0].out, 0);
}

// Where a step meets a segment, by Cramer's rule: another way than the counter's.
int brute_crossing(const Line& line, Point a, Point b) {
  const double ux = b.x - a.x, uy = b.y - a.y;
  const double vx = line.to.x - line.from.x, vy = line.to.y - line.from.y;
  const double determinant = ux * vy - uy * vx;
  if (determinant == 0) return 0;
  const double wx = line.from.x - a.x, wy = line.from.y - a.y;
  const double along_step = (wx * vy - wy * vx) / determinant;
  const double along_line = (wx * uy - wy * ux) / determinant;
  if (along_step < 0 || along_step > 1 || along_line < 0 || along_line > 1) return 0;
  return determinant < 0 ? 1 : -1;
}

// Whether the corners turn once around the point: another way than the counter's.
bool brute_contains(const Area& area, Point p) {
  double turned = 0;
  for (std::size_t i = 0; i < area.corners.size(); ++i) {
    const Point a = area.corners[i], b = area.corners[(i + 1) % area.corners.size()];
    const double angle = std::atan2(b.y - p.y, b.x - p.x) - std::atan2(a.y - p.y, a.x - p.x);
    turned += std::remainder(angle, 2 * std::numbers::pi);
  }
  return std::abs(turned) > 3;
}

TEST(ZoneCounter, CountsRandomWalksAsGeometryDoes) {
  nn::Random random(2);
  const auto somewhere = [&] { return Point{random.uniform(0, 600), random.uniform(0, 400)}; };
  const Area star{"star",
                  {{300, 40},
                   {360, 160},
                   {520, 180},
                   {380, 230},
                   {420, 370},
                   {300, 280},
                   {150, 360},
                   {230, 220},
                   {90, 170},
                   {250, 150}}};
  for (int round = 0; round < 30; ++round) {
    const Line line{"line", somewhere(), somewhere()};
    Clock clock(plan({line}, {star}), {.margin = 0});
    constexpr int kPeople = 6;
    struct Walker {
      Point at, goal;
      std::optional<Point> before;
    };
    std::vector<Walker> walkers(kPeople);
    for (Walker& walker : walkers) walker = {somewhere(), somewhere(), {}};
    std::int64_t in = 0, out = 0, stays = 0;
    double person_seconds = 0;
    int most = 0;
    std::vector<bool> was_inside(kPeople, false);
    for (int frame = 0; frame < 400; ++frame) {
      std::vector<track::TrackedBox> boxes;
      int inside_now = 0;
      for (int k = 0; k < kPeople; ++k) {
        Walker& walker = walkers[k];
        const double distance =
            std::hypot(walker.goal.x - walker.at.x, walker.goal.y - walker.at.y);
        if (distance < 9) walker.goal = somewhere();
        const double step = 8 / std::max(distance, 8.0);
        walker.before = walker.at;
        walker.at = {walker.at.x + step * (walker.goal.x - walker.at.x),
                     walker.at.y + step * (walker.goal.y - walker.at.y)};
        boxes.push_back(standing_at(k + 1, walker.at));
        if (frame > 0) {
          const int crossed = brute_crossing(line, *walker.before, walker.at);
          in += crossed > 0;
          out += crossed < 0;
        }
        const bool inside = brute_contains(star, walker.at);
        stays += inside && !was_inside[k];
        if (was_inside[k]) person_seconds += 0.1;
        was_inside[k] = inside;
        inside_now += inside;
      }
      clock.add(boxes);
      most = std::max(most, inside_now);
      EXPECT_EQ(clock.counter.areas()[0].inside, inside_now) << "frame " << frame;
    }
    clock.finish();
    EXPECT_EQ(clock.counter.lines()[0].in, in);
    EXPECT_EQ(clock.counter.lines()[0].out, out);
    EXPECT_EQ(clock.counter.areas()[0].stays, stays);
    EXPECT_EQ(clock.counter.areas()[0].ended, stays);
    EXPECT_GE(clock.counter.areas()[0].most_inside, most);
    EXPECT_NEAR(clock.counter.areas()[0].dwell, person_seconds, 1e-6);
  }
}

TEST(ZoneCounter, TellsWalkingInFromBeingFoundWithin) {
  Clock clock(plan({}, {kHall}));
  clock.walk(1, {200, 200}, {200, 400}, 20);
  clock.walk(1, {200, 400}, {200, 200}, 20);
  clock.finish();
  ASSERT_EQ(clock.events.size(), 4u);
  EXPECT_EQ(clock.events[0].kind, EventKind::enter);
  EXPECT_FALSE(clock.events[0].witnessed);
  EXPECT_EQ(clock.events[1].kind, EventKind::leave);
  EXPECT_TRUE(clock.events[1].witnessed);
  EXPECT_NEAR(clock.events[1].dwell, 1.1, 1e-9);  // from 200 to the first foot clearly outside, 310
  EXPECT_EQ(clock.events[2].kind, EventKind::enter);
  EXPECT_TRUE(clock.events[2].witnessed);
  EXPECT_EQ(clock.events[3].kind, EventKind::leave);
  EXPECT_FALSE(clock.events[3].witnessed);
  EXPECT_EQ(clock.counter.areas()[0].stays, 2);
  EXPECT_EQ(clock.counter.areas()[0].inside, 0);
}

TEST(ZoneCounter, AnAreaSmallerThanItsMarginStillCounts) {
  const Area mat{"mat", {{198, 198}, {202, 198}, {202, 202}, {198, 202}}};
  Clock clock(plan({}, {mat}));
  clock.walk(1, {200, 150}, {200, 250}, 100);
  EXPECT_EQ(clock.counter.areas()[0].stays, 1);
  EXPECT_EQ(clock.counter.areas()[0].ended, 1);
}

TEST(ZoneCounter, WhoIsNotSeenForLongHasGoneWhenLastSeen) {
  Clock clock(plan({}, {kHall}), {.forget = 2});
  clock.walk(7, {200, 150}, {200, 200}, 9);  // ten frames
  clock.nobody(20);
  EXPECT_EQ(clock.counter.areas()[0].inside, 1);
  clock.nobody(1);
  EXPECT_EQ(clock.counter.areas()[0].inside, 0);
  ASSERT_EQ(clock.events.size(), 2u);
  EXPECT_EQ(clock.events[1].frame, 10);
  EXPECT_DOUBLE_EQ(clock.events[1].time, 1.0);
  EXPECT_FALSE(clock.events[1].witnessed);
}

// One person in two parts, whom the tracker joins later.
TEST(ZoneCounter, JoinedIdsHaveOneStay) {
  for (const int gap : {5, 25}) {  // frames; the longer is forgotten in between
    Clock clock(plan({}, {kHall}), {.forget = 2});
    clock.walk(1, {200, 90}, {200, 200}, 10);
    clock.nobody(gap);
    clock.walk(2, {210, 200}, {220, 200}, 10);
    EXPECT_EQ(clock.counter.areas()[0].stays, 2);
    clock.add({standing_at(1, {220, 200})}, {{2, 1}});
    EXPECT_EQ(clock.counter.areas()[0].stays, 1);
    EXPECT_EQ(clock.counter.areas()[0].inside, 1);
    EXPECT_EQ(clock.counter.areas()[0].ended, 0);
    const ZoneEvent& told = clock.events.back();
    EXPECT_EQ(told.kind, EventKind::continued);
    EXPECT_EQ(told.id, 1);
    EXPECT_EQ(told.former_id, 2);
    clock.walk(1, {220, 200}, {220, 400}, 20);
    const ZoneEvent& left = clock.events.back();
    ASSERT_EQ(left.kind, EventKind::leave);
    EXPECT_NEAR(left.dwell, left.time - clock.events.front().time, 1e-9);
    EXPECT_EQ(clock.counter.areas()[0].ended, 1);
    EXPECT_NEAR(clock.counter.areas()[0].dwell, left.dwell, 1e-9);
  }
}

TEST(ZoneCounter, ACrossingBetweenTwoJoinedIdsIsCountedUnwitnessed) {
  Clock clock(plan({kDoor}, {}));
  clock.walk(1, {200, 100}, {200, 180}, 10);
  clock.nobody(5);
  clock.walk(2, {205, 240}, {205, 300}, 10);
  EXPECT_EQ(clock.counter.lines()[0].in, 0);
  clock.add({standing_at(1, {205, 305})}, {{2, 1}});
  EXPECT_EQ(clock.counter.lines()[0].in, 1);
  EXPECT_FALSE(clock.events.back().witnessed);
}

TEST(ZoneCounter, ACrossingWhileHiddenIsCountedUnwitnessed) {
  Clock clock(plan({kDoor}, {}));
  clock.walk(1, {200, 100}, {200, 180}, 10);
  clock.nobody(5);
  clock.walk(1, {205, 240}, {205, 300}, 10);
  ASSERT_EQ(clock.events.size(), 1u);
  EXPECT_EQ(clock.events[0].kind, EventKind::in);
  EXPECT_FALSE(clock.events[0].witnessed);
}

TEST(ZoneCounter, KeepsHoursApart) {
  ZoneCounter counter(plan({kDoor}, {kHall}));
  const auto walk_in = [&](int id, double start) {
    for (int i = 0; i <= 20; ++i) {
      const track::FinishedFrame frame{i + 1, {standing_at(id, {200, 100 + 10.0 * i})}, {}};
      counter.add(frame, start + i);
    }
  };
  walk_in(1, 100);
  walk_in(2, 3590);  // on the line at 3600
  walk_in(3, 8000);
  ASSERT_EQ(counter.line_hours().size(), 3u);
  EXPECT_EQ(counter.line_hours().at(0)[0].in, 1);
  EXPECT_EQ(counter.line_hours().at(1)[0].in, 1);
  EXPECT_EQ(counter.line_hours().at(2)[0].in, 1);
  EXPECT_EQ(counter.area_hours().at(0)[0].stays, 2);
  EXPECT_EQ(counter.area_hours().at(2)[0].stays, 1);
  const std::string table = counts_table(counter);
  EXPECT_THAT(table, testing::StartsWith(
                         "zone,kind,hour,in,out,stays,inside,most_inside,mean_dwell,longest_dwell\n"
                         "door,line,all,3,0,,,,,\n"
                         "hall,area,all,,,3,"));
  EXPECT_THAT(table, testing::HasSubstr("\ndoor,line,1,1,0,,,,,\n"));
}

TEST(ZoneCounter, RefusesTimeThatGoesBack) {
  ZoneCounter counter(plan({kDoor}, {}));
  counter.add({1, {}, {}}, 5);
  EXPECT_NO_THROW(counter.add({2, {}, {}}, 5));
  EXPECT_THROW(counter.add({3, {}, {}}, 4.9), std::invalid_argument);
  EXPECT_THROW(counter.add({3, {}, {}}, NAN), std::invalid_argument);
}

TEST(ZoneCounter, RefusesOptionsOutOfRange) {
  EXPECT_THROW(ZoneCounter(plan({kDoor}, {}), {.margin = -0.1}), std::invalid_argument);
  EXPECT_THROW(ZoneCounter(plan({kDoor}, {}), {.forget = 0}), std::invalid_argument);
  EXPECT_THROW(ZoneCounter(plan({kDoor}, {}), {.forget = 5, .remember = 4}), std::invalid_argument);
  EXPECT_THROW(ZoneCounter(plan({}, {})), std::invalid_argument);
}

TEST(EventLine, IsOneLineOfJson) {
  ZoneEvent event{EventKind::leave, "a \"quoted\"\nname", 3, 0, 120, 4.76, true, 2.5};
  EXPECT_EQ(event_line(event),
            "{\"event\":\"leave\",\"zone\":\"a \\\"quoted\\\"\\nname\",\"id\":3,\"frame\":120,"
            "\"time\":4.76,\"dwell\":2.5,\"witnessed\":true}\n");
  event = {EventKind::continued, "hall", 1, 9, 7, 0.28};
  EXPECT_EQ(event_line(event),
            "{\"event\":\"continued\",\"zone\":\"hall\",\"id\":1,\"former_id\":9,\"frame\":7,"
            "\"time\":0.28}\n");
}

}  // namespace
}  // namespace sdmt::zones
