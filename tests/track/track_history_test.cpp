// SPDX-License-Identifier: Apache-2.0
#include "track_history.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::track {
namespace {

OutputRules reporting(ReportBox report, FillGaps fill = FillGaps::all, int max_fill = 30) {
  TrackerOptions options;
  options.output.report = report;
  options.output.fill = fill;
  options.output.max_fill = max_fill;
  return {options.output, options.motion, options.decision_lag()};
}

mot::Cxcywh walker(int frame) { return {10.0 * frame, 100.0 + frame, 40, 80}; }

TrackHistory seen_at(const OutputRules& rules, const std::vector<int>& frames) {
  TrackHistory history(rules);
  for (const int frame : frames) {
    history.append(frame, walker(frame), walker(frame), 0.9, BoxSource::detected);
  }
  return history;
}

TEST(TrackHistory, ReportsBoxesAndFillsGapsOnAStraightLine) {
  for (const ReportBox report : {ReportBox::detection, ReportBox::filtered, ReportBox::smoothed}) {
    const OutputRules rules(reporting(report));
    TrackHistory history = seen_at(rules, {5, 6, 7, 8, 9, 14, 15, 16, 17, 18});
    EXPECT_FALSE(history.at(4));
    EXPECT_FALSE(history.at(19));
    // Constant velocity: every way to fill the gap agrees (the smoother up to its weak prior).
    const double tolerance = report == ReportBox::smoothed ? 1.5 : 1e-9;
    for (int frame = 5; frame <= 18; ++frame) {
      const auto box = history.at(frame);
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
  EXPECT_FALSE(seen_at(none, frames).at(3));
  const OutputRules all(reporting(ReportBox::detection, FillGaps::all, 10));
  EXPECT_TRUE(seen_at(all, frames).at(3));
  EXPECT_TRUE(seen_at(all, frames).at(10));  // 10 frames are missing
  const OutputRules shorter(reporting(ReportBox::detection, FillGaps::all, 9));
  EXPECT_TRUE(seen_at(shorter, frames).at(4));
  EXPECT_FALSE(seen_at(shorter, frames).at(10));
  const OutputRules merged(reporting(ReportBox::detection, FillGaps::merged));
  TrackHistory history = seen_at(merged, {10, 11, 13});
  history.prepend(seen_at(merged, {1, 3}));
  EXPECT_FALSE(history.at(2));
  EXPECT_TRUE(history.at(5));
  EXPECT_FALSE(history.at(12));
  // The seam stays one when the track is joined again.
  history.prepend(seen_at(merged, {-5}));
  EXPECT_TRUE(history.at(5));
  EXPECT_TRUE(history.at(0));
  EXPECT_FALSE(history.at(2));
}

TEST(TrackHistory, JoinedPartsSmoothAsOneTrack) {
  const OutputRules rules(reporting(ReportBox::smoothed));
  nn::Random random(8);
  TrackHistory whole(rules), older(rules), newer(rules);
  for (const int frame : {1, 2, 3, 4, 5, 12, 13, 14, 15}) {
    mot::Cxcywh box = walker(frame);
    box.cx += random.normal();
    whole.append(frame, box, box, 1, BoxSource::detected);
    (frame < 10 ? older : newer).append(frame, box, box, 1, BoxSource::detected);
  }
  newer.prepend(older);
  for (int frame = 1; frame <= 15; ++frame) {
    ASSERT_TRUE(whole.at(frame));
    EXPECT_EQ(whole.at(frame)->box, newer.at(frame)->box) << frame;
  }
}

TEST(TrackHistory, ForgettingChangesNoLaterAnswer) {
  for (const ReportBox report : {ReportBox::filtered, ReportBox::smoothed}) {
    const OutputRules rules(reporting(report));
    TrackHistory kept(rules), forgetful(rules);
    nn::Random random(9);
    std::map<int, mot::Cxcywh> boxes;
    for (int frame = 1; frame <= 400; ++frame) {
      if (random.uniform() < 0.3) continue;
      mot::Cxcywh box = walker(frame);
      box.cy += random.normal();
      kept.append(frame, box, box, 1, BoxSource::detected);
      forgetful.append(frame, box, box, 1, BoxSource::detected);
      for (int asked = std::max(1, frame - 20); asked <= frame; ++asked) {
        const auto expected = kept.at(asked);
        const auto got = forgetful.at(asked);
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
  TrackHistory history(smooth), measured(raw);
  for (int frame = 1; frame <= 200; ++frame) {
    mot::Cxcywh box = walker(frame);
    box.cx += 4 * random.normal();
    history.append(frame, box, box, 1, BoxSource::detected);
    measured.append(frame, box, box, 1, BoxSource::detected);
  }
  double before = 0, after = 0;
  for (int frame = 1; frame <= 200; ++frame) {
    before += std::abs(mot::to_cxcywh(measured.at(frame)->box).cx - walker(frame).cx);
    after += std::abs(mot::to_cxcywh(history.at(frame)->box).cx - walker(frame).cx);
  }
  EXPECT_LT(after, 0.4 * before);
}

TEST(TrackHistory, SmoothedSizesStayPositive) {
  const OutputRules rules(reporting(ReportBox::smoothed));
  TrackHistory history(rules);
  history.append(1, {0, 0, 1e9, 1e9}, {}, 1, BoxSource::detected);
  history.append(2, {0, 0, 1e-6, 1e-6}, {}, 1, BoxSource::detected);
  history.append(9, {1e9, 0, 1e-6, 1e9}, {}, 1, BoxSource::boosted);
  for (int frame = 1; frame <= 9; ++frame) {
    const auto box = history.at(frame)->box;
    EXPECT_TRUE(std::isfinite(box.left) && std::isfinite(box.top)) << frame;
    EXPECT_GT(box.width, 0) << frame;
    EXPECT_GT(box.height, 0) << frame;
  }
}

}  // namespace
}  // namespace sdmt::track
