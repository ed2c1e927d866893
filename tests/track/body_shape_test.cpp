// SPDX-License-Identifier: Apache-2.0
#include "body_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "scene.h"
#include "sdmt/track/track_smoothing.h"
#include "sdmt/track/tracker.h"

namespace sdmt::track {
namespace {

constexpr image::PictureSize kPicture{640, 480};

// What a detector sees of a box of which the first pixel of the picture is 1, 1.
mot::Tlwh seen(const mot::Tlwh& box, const image::PictureSize& picture = kPicture) {
  const double left = std::max(box.left, 1.0), top = std::max(box.top, 1.0);
  return {left, top, std::min(box.left + box.width, picture.width + 1.0) - left,
          std::min(box.top + box.height, picture.height + 1.0) - top};
}

BodyShape shape_of(double width, double height) {
  BodyShape shape;
  shape.see({300, 200, width, height}, kPicture);
  return shape;
}

TEST(BodyShape, CompletesABoxBeyondEachSide) {
  const BodyShape shape = shape_of(40, 100);
  for (const mot::Tlwh& person :
       {mot::Tlwh{-15, 100, 40, 100}, mot::Tlwh{-25, 100, 60, 150}, mot::Tlwh{620, 100, 40, 100},
        mot::Tlwh{300, 440, 40, 100}, mot::Tlwh{300, -30, 40, 100}}) {
    ASSERT_LT(mot::iou(seen(person), person), 0.9);
    EXPECT_NEAR(mot::iou(shape.whole(seen(person), kPicture), person), 1, 1e-9)
        << person.left << ", " << person.top;
  }
}

TEST(BodyShape, LeavesABoxAsItIsWhereItCannotKnow) {
  const BodyShape shape = shape_of(40, 100);
  const mot::Tlwh inside{300, 200, 20, 100}, corner{1, 400, 20, 81}, across{1, 100, 640, 300},
      cut{1, 100, 20, 100};
  for (const mot::Tlwh& box : {inside, corner, across}) EXPECT_EQ(shape.whole(box, kPicture), box);
  EXPECT_EQ(shape.whole({300, 1, 40, 480}, kPicture), (mot::Tlwh{300, 1, 40, 480}));
  EXPECT_NE(shape.whole(cut, kPicture), cut);
  EXPECT_EQ(shape.whole(cut, {}), cut);  // off
  EXPECT_EQ(BodyShape().whole(cut, kPicture), cut);
  // Never smaller than it was seen: of somebody who spreads their arms.
  EXPECT_EQ(shape.whole({1, 100, 70, 100}, kPicture), (mot::Tlwh{1, 100, 70, 100}));
}

TEST(BodyShape, NobodyIsAsThinAsALine) {
  BodyShape shape;
  for (const double extent : {1e-300, 1e-6}) {
    shape.see({300, 200, extent, 100}, kPicture);
    shape.see({300, 200, 100, extent}, kPicture);
  }
  shape.see({300, 200, 40, 100}, {});  // off
  EXPECT_EQ(shape.boxes, 0);
  EXPECT_EQ(shape.aspect, 0);
}

TEST(BodyShape, IsTheMeanOfTheLastBoxesSeenWhole) {
  BodyShape shape = shape_of(40, 100);
  shape.see({1, 100, 5, 100}, kPicture);  // cut
  EXPECT_DOUBLE_EQ(shape.aspect, 0.4);
  shape.see({300, 200, 60, 100}, kPicture);
  EXPECT_DOUBLE_EQ(shape.aspect, 0.5);
  for (int i = 0; i < 200; ++i) shape.see({300, 200, 30, 100}, kPicture);
  EXPECT_NEAR(shape.aspect, 0.3, 1e-3);
  EXPECT_EQ(shape.boxes, BodyShape::kRecent);
}

// Two people cross the picture from the left and from the right and leave it on the other side, a
// third walks out below.
std::vector<mot::Tlwh> walkers(int frame) {
  return {{-45.0 + 4 * frame, 100, 44, 110},
          {645.0 - 4 * frame, 250, 40, 100},
          {300, 250 + 1.0 * frame, 48, 120}};
}
constexpr int kFrames = 172;

// The worst overlap of a person who is half in the picture with what is reported of them.
double worst_overlap(const std::vector<FinishedFrame>& frames) {
  double worst = 1;
  for (const FinishedFrame& frame : frames) {
    for (const mot::Tlwh& person : walkers(frame.frame)) {
      const mot::Tlwh visible = seen(person);
      if (visible.width < person.width / 2 || visible.height < person.height / 2) continue;
      double best = 0;
      for (const TrackedBox& box : frame.boxes) best = std::max(best, mot::iou(box.box, person));
      worst = std::min(worst, best);
    }
  }
  return worst;
}

std::vector<FinishedFrame> tracked(const image::PictureSize& amodal) {
  TrackerOptions options;
  options.output.amodal = amodal;
  Tracker tracker(options);
  std::vector<FinishedFrame> all;
  for (int frame = 1; frame <= kFrames; ++frame) {
    std::vector<mot::Detection> boxes;
    for (const mot::Tlwh& person : walkers(frame)) {
      const mot::Tlwh visible = seen(person);
      if (std::min(visible.width, visible.height) > 8) boxes.push_back({visible, 0.9});
    }
    for (const auto& done : tracker.update(boxes)) all.push_back(done);
  }
  for (const auto& done : tracker.finish()) all.push_back(done);
  return all;
}

TEST(Amodal, PeopleAreReportedWholeAsTheyComeAndAsTheyGo) {
  const auto off = tracked({}), on = tracked(kPicture);
  EXPECT_LT(worst_overlap(off), 0.6);
  EXPECT_GT(worst_overlap(on), 0.75);
  // Nothing else changes.
  ASSERT_EQ(on.size(), off.size());
  int changed = 0;
  for (std::size_t i = 0; i < on.size(); ++i) {
    ASSERT_EQ(on[i].boxes.size(), off[i].boxes.size());
    for (std::size_t k = 0; k < on[i].boxes.size(); ++k) {
      const TrackedBox &box = on[i].boxes[k], &before = off[i].boxes[k];
      EXPECT_EQ(box.id, before.id);
      if (box.box == before.box) continue;
      ++changed;
      EXPECT_TRUE(cut_sides(before.box, kPicture).any());
    }
  }
  EXPECT_GT(changed, 30);
}

TEST(Amodal, OtherTrackersBoxesAreCompletedAlike) {
  std::vector<FinishedFrame> frames;
  for (int frame = 1; frame <= kFrames; ++frame) {
    FinishedFrame& made = frames.emplace_back(FinishedFrame{frame, {}, {}});
    for (const mot::Tlwh& person : walkers(frame)) {
      const mot::Tlwh visible = seen(person);
      if (std::min(visible.width, visible.height) <= 8) continue;
      made.boxes.push_back({static_cast<int>(person.height), visible, 0.9, BoxSource::detected});
    }
  }
  OutputOptions output;
  EXPECT_LT(worst_overlap(smooth_tracks(frames, output, {})), 0.6);
  output.amodal = kPicture;
  EXPECT_GT(worst_overlap(smooth_tracks(frames, output, {})), 0.75);
}

TEST(Amodal, ATrackerDoesNotKnowItsInput) {
  TrackerOptions options;
  options.output.amodal = OutputOptions::kInputSize;
  EXPECT_NO_THROW(options.validate());
  EXPECT_THROW(Tracker{options}, std::invalid_argument);
  EXPECT_THROW(smooth_tracks({}, options.output, {}), std::invalid_argument);
  options.output.amodal = {640, -480};
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::track
