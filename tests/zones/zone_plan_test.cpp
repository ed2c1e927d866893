// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/zone_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace sdmt::zones {
namespace {

using testing::HasSubstr;

const char* const kPlan = R"({"picture": [200, 100],
  "lines": [{"name": "door", "from": [11, 51], "to": [111, 51]}],
  "areas": [{"name": "hall", "corners": [[1, 1], [101, 1], [101, 51]]}]})";

std::string refusal(const std::string& text) {
  try {
    parse_zone_plan(text, "zones.json");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(ZonePlan, ReadsLinesAndAreas) {
  const ZonePlan plan = parse_zone_plan(kPlan, "zones.json");
  EXPECT_EQ(plan.width, 200);
  EXPECT_EQ(plan.height, 100);
  ASSERT_EQ(plan.lines.size(), 1u);
  EXPECT_EQ(plan.lines[0].name, "door");
  EXPECT_EQ(plan.lines[0].to, (Point{111, 51}));
  ASSERT_EQ(plan.areas.size(), 1u);
  EXPECT_THAT(plan.areas[0].corners,
              testing::ElementsAre(Point{1, 1}, Point{101, 1}, Point{101, 51}));
}

TEST(ZonePlan, IsScaledWithThePicture) {
  const ZonePlan plan = parse_zone_plan(kPlan, "zones.json").in_picture(400, 200);
  EXPECT_EQ(plan.lines[0].from, (Point{21, 101}));  // 10 and 50 pixels after the first, doubled
  EXPECT_EQ(plan.areas[0].corners[0], (Point{1, 1}));
  EXPECT_EQ(plan.width, 400);
}

TEST(ZonePlan, RefusesAPictureOfOtherProportions) {
  const ZonePlan plan = parse_zone_plan(kPlan, "zones.json");
  EXPECT_THROW(plan.in_picture(400, 300), std::invalid_argument);
  EXPECT_NO_THROW(plan.in_picture(401, 200));
}

TEST(ZonePlan, RefusesAZoneOutsideOfThePicture) {
  const ZonePlan plan = parse_zone_plan(
      R"({"lines": [{"name": "door", "from": [900, 10], "to": [950, 10]}]})", "zones.json");
  EXPECT_NO_THROW(plan.in_picture(1920, 1080));
  try {
    plan.in_picture(640, 480);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("line 'door': lies outside of the picture of 640 x 480"));
  }
}

TEST(ZonePlan, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(refusal("{"), HasSubstr("zones.json"));
  EXPECT_THAT(refusal("[]"), HasSubstr("zones.json: is [], expected an object"));
  EXPECT_THAT(refusal("{}"), HasSubstr("zones.json: no zone"));
  EXPECT_THAT(refusal(R"({"line": []})"),
              HasSubstr("unknown key 'line', expected picture, lines, areas"));
  EXPECT_THAT(refusal(R"({"lines": [{"from": [1, 1], "to": [2, 2]}]})"),
              HasSubstr("zones.json: lines[0]: name is missing"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "a", "from": [1], "to": [2, 2]}]})"),
              HasSubstr("lines[0]: from: [1] is no point, expected [x, y]"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "a", "from": [1, "2"], "to": [2, 2]}]})"),
              HasSubstr("is no point"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "a", "from": [2, 2], "to": [2, 2]}]})"),
              HasSubstr("line 'a': has no length"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "a", "from": [2e9, 2], "to": [2, 2]}]})"),
              HasSubstr("line 'a': a coordinate is 2e+09, expected -1e6..1e6"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "", "from": [1, 2], "to": [2, 2]}]})"),
              HasSubstr("the name has 0 bytes"));
  EXPECT_THAT(refusal(R"({"lines": [{"name": "a", "from": [1, 2], "to": [2, 2]}],
                          "areas": [{"name": "a", "corners": [[1, 1], [9, 1], [9, 9]]}]})"),
              HasSubstr("area 'a': the name comes twice"));
  EXPECT_THAT(refusal(R"({"areas": [{"name": "a", "corners": [[1, 1], [9, 1]]}]})"),
              HasSubstr("has 2 corners, expected 3 to 200"));
  EXPECT_THAT(refusal(R"({"areas": [{"name": "a", "corners": [[1, 1], [9, 9], [9, 1], [1, 9]]}]})"),
              HasSubstr("the edges after corners 1 and 3 cross"));
  EXPECT_THAT(refusal(R"({"areas": [{"name": "a", "corners": [[1, 1], [9, 9], [5, 5]]}]})"),
              HasSubstr("area 'a'"));
  EXPECT_THAT(refusal(R"({"picture": [0, 10], "areas": []})"), HasSubstr("picture: a side is 0"));
  EXPECT_THAT(refusal(R"({"lines": 3})"), HasSubstr("lines is 3, expected a list"));
}

}  // namespace
}  // namespace sdmt::zones
