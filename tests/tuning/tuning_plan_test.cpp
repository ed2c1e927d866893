// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "tuning/scenes.h"

namespace sdmt::tuning {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Plan : public testing::Test {
 protected:
  std::string refusal(const TuningOptions& options, const track::TrackerOptions& base = {}) {
    try {
      make_plan(options, base);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  }
  Scenes scenes_;
};

TEST_F(Plan, ReadsSequencesDetectorsAndCalibrations) {
  const std::vector<std::string> names{scenes_.path(), scenes_.file("s2") + "=other.txt@1,0.5"};
  const auto sequences = read_sequences(names);
  ASSERT_EQ(sequences.size(), 3U);
  EXPECT_EQ(sequences[0].gt.name, "s1");
  EXPECT_EQ(sequences[1].gt.name, "s2");
  EXPECT_EQ(sequences[1].detector, "det.txt");
  EXPECT_FALSE(sequences[1].calibration);
  EXPECT_EQ(sequences[2].gt.name, "s2");
  EXPECT_EQ(sequences[2].detector, "other.txt");
  EXPECT_EQ(sequences[2].calibration, (track::ScoreCalibration{1, 0.5}));
  EXPECT_EQ(sequences[2].detections.size(), sequences[1].detections.size());
  // Options that have a calibration keep it.
  track::TrackerOptions options;
  EXPECT_EQ(sequences[2].adjusted(options).input.calibration, sequences[2].calibration);
  options.input.calibration = {2, 2};
  EXPECT_EQ(sequences[2].adjusted(options).input.calibration, options.input.calibration);
  // So do those that have a picture's size; "auto" is that of the sequence.
  options.output.amodal = {7, 8};
  EXPECT_EQ(sequences[0].adjusted(options).output.amodal, (image::PictureSize{7, 8}));
  options.output.amodal = track::OutputOptions::kInputSize;
  EXPECT_EQ(sequences[0].adjusted(options).output.amodal, (image::PictureSize{320, 180}));
  TuningSequence unstated = sequences[0];
  unstated.sequence.width = 0;
  EXPECT_THROW(unstated.adjusted(options), std::invalid_argument);
}

TEST_F(Plan, HasTheBaseAndEveryCombinationOnce) {
  const TuningPlan plan = make_plan(scenes_.options(), {});
  EXPECT_THAT(plan.tuned, ElementsAre("min-length", "min-iou"));
  ASSERT_EQ(plan.settings.size(), 9U);
  EXPECT_THAT(plan.settings.front().values, ElementsAre("6", "0.3"));  // the tuned preset
  std::set<std::vector<std::string>> seen;
  for (const TuningSetting& setting : plan.settings) {
    seen.insert(setting.values);
    EXPECT_EQ(std::to_string(setting.options.confidence.min_length), setting.values[0]);
  }
  EXPECT_EQ(seen.size(), 9U);
  EXPECT_EQ(plan.frames(), 2 * Scenes::kFrames);
  EXPECT_EQ(plan.runs(), 10 * 2 * 2);
}

TEST_F(Plan, DrawsSoManyBySeed) {
  TuningOptions options = scenes_.options();
  options.settings = 4;
  const auto values = [&](std::uint64_t seed) {
    options.seed = seed;
    std::vector<std::vector<std::string>> all;
    for (const auto& setting : make_plan(options, {}).settings) all.push_back(setting.values);
    return all;
  };
  const auto first = values(1);
  EXPECT_EQ(first.size(), 4U);
  EXPECT_THAT(first.front(), ElementsAre("6", "0.3"));
  EXPECT_EQ(values(1), first);
  EXPECT_NE(values(2), first);
}

TEST_F(Plan, TakesSwitchesAsTheyAreTyped) {
  TuningOptions options = scenes_.options();
  options.tuned = {{"association", {"on", "off", "true"}}};
  const TuningPlan plan = make_plan(options, {});
  ASSERT_EQ(plan.settings.size(), 2U);
  EXPECT_THAT(plan.settings[1].values, ElementsAre("false"));
  EXPECT_FALSE(plan.settings[1].options.association.enabled);
}

TEST_F(Plan, SaysWhatCannotBe) {
  const auto with = [&](auto change) {
    TuningOptions options = scenes_.options();
    change(options);
    return refusal(options);
  };
  EXPECT_EQ(with([](auto& o) { o.tuned[0].name = "speed"; }), "the tracker has no option 'speed'");
  EXPECT_EQ(with([](auto& o) { o.tuned[1].name = "min-length"; }),
            "option min-length is given twice");
  EXPECT_EQ(with([](auto& o) { o.tuned[1].values = {"2"}; }),
            "min_iou is 2, expected >= 0 and < 1");
  EXPECT_EQ(with([](auto& o) { o.tuned[1].values.clear(); }),
            "option min-iou has no values, expected one at least");
  EXPECT_EQ(with([](auto& o) { o.tuned.clear(); }), "options is none, expected one at least");
  EXPECT_EQ(with([](auto& o) { o.settings = 0; }), "settings is 0, expected 1..100000");
  EXPECT_EQ(with([](auto& o) { o.draws = -1; }), "draws is -1, expected 1..1000");
  EXPECT_EQ(with([](auto& o) { o.drop = 1; }), "drop is 1, expected 0..0.9");
  EXPECT_THAT(with([](auto& o) { o.sequences.clear(); }), HasSubstr("one is left out"));
  EXPECT_THAT(with([&](auto& o) { o.sequences = {scenes_.file("s1")}; }),
              HasSubstr("one is left out"));
  EXPECT_EQ(with([&](auto& o) { o.sequences.push_back(scenes_.file("s1")); }),
            "sequence s1 is given twice with det.txt");
  EXPECT_THAT(with([&](auto& o) { o.sequences = {scenes_.path() + "=none.txt"}; }),
              HasSubstr("none.txt"));
  EXPECT_THAT(with([&](auto& o) { o.sequences = {scenes_.path() + "=det.txt@hot"}; }),
              HasSubstr("calibration is 'hot'"));
  EXPECT_THAT(with([](auto& o) {
                const std::vector<std::string> many(101, "0.1");
                o.tuned = {{"nms", many}, {"min-iou", many}, {"lambda", many}};
              }),
              HasSubstr("more than 1,000,000 combinations"));
  track::TrackerOptions base;
  base.motion.max_misses = 0;
  EXPECT_THAT(refusal(scenes_.options(), base), HasSubstr("max_misses is 0"));
}

}  // namespace
}  // namespace sdmt::tuning
