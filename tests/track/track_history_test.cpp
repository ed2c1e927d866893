// SPDX-License-Identifier: Apache-2.0
#include "track_history.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::track {
namespace {

TrackerOptions reporting(ReportBox report, FillGaps fill = FillGaps::all, int max_fill = 30) {
  TrackerOptions options;
  options.report = report;
  options.fill = fill;
  options.max_fill = max_fill;
  return options;
}

mot::Cxcywh walker(int frame) { return {10.0 * frame, 100.0 + frame, 40, 80}; }

TrackHistory seen_at(const OutputRules& rules, const std::vector<int>& frames) {
  TrackHistory history;
  for (const int frame : frames) {
    history.append(rules, frame, walker(frame), walker(frame), 0.9, BoxSource::detected);
  }
  return history;
}

TEST(TrackHistory, ReportsBoxesAndFillsGapsOnAStraightLine) {
  for (const ReportBox report : {ReportBox::detection, ReportBox::filtered, ReportBox::smoothed}) {
    const OutputRules rules(reporting(report));
    TrackHistory history = seen_at(rules, {5, 6, 7, 8, 9, 14, 15, 16, 17, 18});
    EXPECT_FALSE(history.at(rules, 4));
    EXPECT_FALSE(history.at(rules, 19));
    // Constant velocity: every way to fill the gap agrees (the smoother up to its weak prior).
    const double tolerance = report == ReportBox::smoothed ? 1.5 : 1e-9;
    for (int frame = 5; frame <= 18; ++frame) {
      const auto box = history.at(rules, frame);
      ASSERT_TRUE(box) << frame;
      const bool seen = frame <= 9 || frame >= 14;
      EXPECT_EQ(box->source, seen ? BoxSource::detected : BoxSource::interpolated);
      EXPECT_EQ(box->score, seen ? 0.9 : 0.0);
      EXPECT_NEAR(mot::to_cxcywh(box->box).cx, walker(frame).cx, tolerance) << frame;
      EXPECT_NEAR(mot::to_cxcywh(box->box).cy, walker(frame).cy, tolerance) << frame;
      EXPECT_NEAR(box->box.height, 80, tolerance) << frame;
    }
  }
}

TEST(TrackHistory, FillsOnlyWhatTheRulesAllow) {
  const std::vector<int> frames = {1, 2, 5, 6, 17};
  const OutputRules none(reporting(ReportBox::detection, FillGaps::none));
  EXPECT_FALSE(seen_at(none, frames).at(none, 3));
  const OutputRules all(reporting(ReportBox::detection, FillGaps::all, 10));
  EXPECT_TRUE(seen_at(all, frames).at(all, 3));
  EXPECT_TRUE(seen_at(all, frames).at(all, 10));  // 10 frames are missing
  const OutputRules shorter(reporting(ReportBox::detection, FillGaps::all, 9));
  EXPECT_TRUE(seen_at(shorter, frames).at(shorter, 4));
  EXPECT_FALSE(seen_at(shorter, frames).at(shorter, 10));
  const OutputRules merged(reporting(ReportBox::detection, FillGaps::merged));
  TrackHistory history = seen_at(merged, {10, 11, 13});
  history.prepend(merged, seen_at(merged, {1, 3}));
  EXPECT_FALSE(history.at(merged, 2));
  EXPECT_TRUE(history.at(merged, 5));
  EXPECT_FALSE(history.at(merged, 12));
  // The seam stays one when the track is joined again.
  history.prepend(merged, seen_at(merged, {-5}));
  EXPECT_TRUE(history.at(merged, 5));
  EXPECT_TRUE(history.at(merged, 0));
  EXPECT_FALSE(history.at(merged, 2));
}

TEST(TrackHistory, JoinedPartsSmoothAsOneTrack) {
  const OutputRules rules(reporting(ReportBox::smoothed));
  nn::Random random(8);
  TrackHistory whole, older, newer;
  for (const int frame : {1, 2, 3, 4, 5, 12, 13, 14, 15}) {
    mot::Cxcywh box = walker(frame);
    box.cx += random.normal();
    whole.append(rules, frame, box, box, 1, BoxSource::detected);
    (frame < 10 ? older : newer).append(rules, frame, box, box, 1, BoxSource::detected);
  }
  newer.prepend(rules, older);
  for (int frame = 1; frame <= 15; ++frame) {
    ASSERT_TRUE(whole.at(rules, frame));
    EXPECT_EQ(whole.at(rules, frame)->box, newer.at(rules, frame)->box) << frame;
  }
}

TEST(TrackHistory, ForgettingChangesNoLaterAnswer) {
  for (const ReportBox report : {ReportBox::filtered, ReportBox::smoothed}) {
    const OutputRules rules(reporting(report));
    TrackHistory kept, forgetful;
    nn::Random random(9);
    std::map<int, mot::Cxcywh> boxes;
    for (int frame = 1; frame <= 400; ++frame) {
      if (random.uniform() < 0.3) continue;
      mot::Cxcywh box = walker(frame);
      box.cy += random.normal();
      kept.append(rules, frame, box, box, 1, BoxSource::detected);
      forgetful.append(rules, frame, box, box, 1, BoxSource::detected);
      for (int asked = std::max(1, frame - 20); asked <= frame; ++asked) {
        const auto expected = kept.at(rules, asked);
        const auto got = forgetful.at(rules, asked);
        ASSERT_EQ(expected.has_value(), got.has_value()) << frame << " " << asked;
        if (expected) {
          EXPECT_EQ(expected->box, got->box);
        }
      }
      forgetful.forget(frame - 20);
    }
  }
}

TEST(TrackHistory, SmoothingRemovesNoise) {
  const OutputRules smooth(reporting(ReportBox::smoothed)), raw(reporting(ReportBox::detection));
  nn::Random random(10);
  TrackHistory history;
  for (int frame = 1; frame <= 200; ++frame) {
    mot::Cxcywh box = walker(frame);
    box.cx += 4 * random.normal();
    history.append(smooth, frame, box, box, 1, BoxSource::detected);
  }
  double before = 0, after = 0;
  for (int frame = 1; frame <= 200; ++frame) {
    before += std::abs(mot::to_cxcywh(history.at(raw, frame)->box).cx - walker(frame).cx);
    after += std::abs(mot::to_cxcywh(history.at(smooth, frame)->box).cx - walker(frame).cx);
  }
  EXPECT_LT(after, 0.4 * before);
}

TEST(TrackHistory, SmoothedSizesStayPositive) {
  const OutputRules rules(reporting(ReportBox::smoothed));
  TrackHistory history;
  history.append(rules, 1, {0, 0, 1e9, 1e9}, {}, 1, BoxSource::detected);
  history.append(rules, 2, {0, 0, 1e-6, 1e-6}, {}, 1, BoxSource::detected);
  history.append(rules, 9, {1e9, 0, 1e-6, 1e9}, {}, 1, BoxSource::boosted);
  for (int frame = 1; frame <= 9; ++frame) {
    const auto box = history.at(rules, frame)->box;
    EXPECT_TRUE(std::isfinite(box.left) && std::isfinite(box.top)) << frame;
    EXPECT_GT(box.width, 0) << frame;
    EXPECT_GT(box.height, 0) << frame;
  }
}

}  // namespace
}  // namespace sdmt::track
