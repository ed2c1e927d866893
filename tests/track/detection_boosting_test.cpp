// SPDX-License-Identifier: Apache-2.0
#include "detection_boosting.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "scene.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::track {
namespace {

class Boosting : public ::testing::Test {
 protected:
  Boosting() {
    options_.boosting.one_pass = false;
    options_.boosting.scale_step = 0.1;
    appearance_.people = {{{100, 100, 40, 90}, 3}};
  }

  Tracklet& add_tracklet(const mot::Tlwh& predicted, const mot::Tlwh& seen, int length = 6) {
    auto tracklet = std::make_unique<Tracklet>(static_cast<int>(active_.size()) + 1, 1,
                                               options_.appearance.gallery_size, rules_);
    const mot::Cxcywh centre = mot::to_cxcywh(predicted);
    tracklet->state.mean = {centre.cx, centre.cy, centre.width, centre.height};
    image::DescriptorRows state;
    appearance_.describe(std::vector<image::Crop>{{image_, to_pixel_rect(seen)}}, state);
    tracklet->gallery.add(state.row(0));
    for (int i = 0; i < length; ++i) tracklet->confidence.add(0.9, 1);
    appearance_.calls = 0;
    active_.push_back(std::move(tracklet));
    return *active_.back();
  }

  int boost(int frame = 10) {
    const int left = boosting_.boost(frame, image_, appearance_, active_, matches_, detections_);
    boosting_.note(frame, active_, {}, detections_);  // nothing boosted was assigned
    return left;
  }

  TrackerOptions options_;
  OutputRules rules_{options_.output, options_.motion, options_.decision_lag()};
  test::FakeDescriptor appearance_;
  image::ImageView image_ = test::blank();
  SceneReport scene_{.assignment_threshold = 0.6};
  DetectionBoosting boosting_{options_.boosting, options_.appearance, options_.confidence, scene_};
  Tracklets active_;
  std::vector<Match> matches_;
  FrameDetections detections_;
};

TEST_F(Boosting, FindsThePersonNearThePrediction) {
  add_tracklet({108, 91, 40, 90}, {100, 100, 40, 90});  // 0.2 widths and 0.1 heights off
  EXPECT_EQ(boost(), 1);
  ASSERT_EQ(detections_.size(), 1u);
  EXPECT_NEAR(iou(detections_.boxes[0], {100, 100, 40, 90}), 1, 1e-9);
  EXPECT_TRUE(detections_.flags[0].boosted && detections_.flags[0].strong);
  EXPECT_TRUE(detections_.flags[0].embedded);
  EXPECT_EQ(boosting_.candidates(), 7u * 7 * 3);
  EXPECT_EQ(appearance_.calls, 1);
}

TEST_F(Boosting, AllCandidatesGoThroughTheNetworkAtOnce) {
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90});
  add_tracklet({500, 100, 40, 90}, {100, 100, 40, 90});
  boost();
  EXPECT_EQ(appearance_.calls, 1);
  EXPECT_EQ(boosting_.candidates(), 2u * 147);
}

TEST_F(Boosting, LeavesOthersAlone) {
  EXPECT_EQ(boost(), 0);                                    // no tracklets
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90}, 5);  // too short to be positive
  EXPECT_EQ(boost(), 0);
  active_.clear();
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90});
  matches_ = {{0, 0, 1}};  // has a detection
  EXPECT_EQ(boost(), 0);
  matches_.clear();
  active_[0]->boosted_frame = 9;  // boosted in the frame before
  EXPECT_EQ(boost(10), 0);
  EXPECT_EQ(boost(11), 1);
}

TEST_F(Boosting, TakesNobodyWhoLooksDifferent) {
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90});
  appearance_.people = {{{100, 100, 40, 90}, 5}};
  EXPECT_EQ(boost(), 0);
  EXPECT_EQ(detections_.size(), 0u);
}

TEST_F(Boosting, AsksForMoreThanTauA) {
  // The nearest sample is 1/20 of a width off: affinity 0.86.
  for (const auto& [margin, found] : std::vector<std::pair<double, int>>{{0.2, 1}, {0.3, 0}}) {
    options_.boosting.margin = margin;
    detections_.clear();
    active_.clear();
    add_tracklet({102, 100, 40, 90}, {100, 100, 40, 90});
    EXPECT_EQ(boost(), found) << margin;
  }
}

TEST_F(Boosting, YieldsToDetectionsAndToBetterBoostedBoxes) {
  add_tracklet({108, 100, 40, 90}, {100, 100, 40, 90});
  FrameDetections::Flags strong;
  strong.strong = true;
  detections_.add({102, 102, 40, 90}, 0.7, strong);
  detections_.add({800, 102, 40, 90}, 0.7, strong);
  detections_.add({803, 102, 40, 90}, 0.6, strong);
  EXPECT_EQ(boost(), 0);
  ASSERT_EQ(detections_.size(), 4u);
  EXPECT_FALSE(detections_.flags[0].dropped || detections_.flags[1].dropped);
  EXPECT_TRUE(detections_.flags[2].dropped);  // a duplicate among the detections
  EXPECT_TRUE(detections_.flags[3].dropped);

  detections_.clear();
  add_tracklet({100, 109, 40, 90}, {100, 100, 40, 90});
  add_tracklet({400, 100, 40, 90}, {100, 100, 40, 90});
  appearance_.people.push_back({{400, 100, 40, 90}, 3});
  EXPECT_EQ(boost(), 2);  // the two on the same person become one
}

// The boosted box yields to a detection, but two detections of which one is dropped were matched.
TEST_F(Boosting, SaysWhenADetectionThatIsMatchedWasDropped) {
  add_tracklet({800, 102, 40, 90}, {800, 102, 40, 90});
  add_tracklet({803, 102, 40, 90}, {803, 102, 40, 90});
  add_tracklet({108, 100, 40, 90}, {100, 100, 40, 90});
  FrameDetections::Flags strong;
  strong.strong = true;
  detections_.add({800, 102, 40, 90}, 0.7, strong);
  detections_.add({803, 102, 40, 90}, 0.6, strong);
  detections_.add({102, 102, 40, 90}, 0.7, strong);
  matches_ = {{0, 0, 1}, {1, 1, 1}};
  EXPECT_EQ(boost(), 0);
  EXPECT_TRUE(detections_.flags[1].dropped);
  EXPECT_TRUE(boosting_.changed());
  EXPECT_EQ(active_[2]->boosted_frame, -1000000);  // nothing came of it

  // A box that yields and takes nothing with it changes nothing.
  detections_.clear();
  detections_.add({102, 102, 40, 90}, 0.7, strong);
  matches_.clear();
  active_.erase(active_.begin(), active_.begin() + 2);
  EXPECT_EQ(boost(), 0);
  EXPECT_FALSE(boosting_.changed());
}

TEST_F(Boosting, StaysInsideTheImage) {
  image_ = test::blank(120, 150);
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90});
  boost();
  for (const mot::Tlwh& box : detections_.boxes) {
    EXPECT_LE(box.left + box.width, 121);
    EXPECT_LE(box.top + box.height, 151);
  }
  image_ = test::blank(1, 1);
  detections_.clear();
  EXPECT_EQ(boost(), 0);  // the prediction is nowhere near a one-pixel image
}

TEST_F(Boosting, InOnePassReadsTheGridSizeBySize) {
  options_.boosting.one_pass = true;
  // The samples 0.2 widths to the left and 0.1 heights up are moved to -3/16 and -3/32.
  add_tracklet({107.5, 108.4375, 40, 90}, {100, 100, 40, 90});
  EXPECT_EQ(boost(), 1);
  EXPECT_EQ(boosting_.candidates(), 7u * 7 * 3);
  EXPECT_EQ(appearance_.passes, 3);
  ASSERT_EQ(detections_.size(), 1u);
  EXPECT_NEAR(iou(detections_.boxes[0], {100, 100, 40, 90}), 1, 1e-9);
  image::DescriptorRows expected;
  appearance_.describe(std::vector<image::Crop>{{image_, to_pixel_rect(detections_.boxes[0])}},
                       expected);
  EXPECT_EQ(detections_.feature(0)[3], expected.row(0)[3]);
}

TEST_F(Boosting, InOnePassBoxesThatLeaveTheImageAreLeftOut) {
  options_.boosting.one_pass = true;
  options_.boosting.scale_step = 0;
  appearance_.people = {{{6, 100, 40, 90}, 3}};
  add_tracklet({1, 100, 40, 90}, {6, 100, 40, 90});
  EXPECT_EQ(boost(), 1);
  EXPECT_EQ(boosting_.candidates(), 4u * 7);  // none to the left of the prediction
  EXPECT_EQ(appearance_.passes, 1);
  EXPECT_EQ(appearance_.calls, 1);
  ASSERT_EQ(detections_.size(), 1u);
  EXPECT_NEAR(iou(detections_.boxes[0], {6, 100, 40, 90}), 1, 1e-9);  // 2/16 of a width
  image_ = test::blank(30, 80);                                       // too small for any
  detections_.clear();
  EXPECT_EQ(boost(20), 0);
  EXPECT_EQ(boosting_.candidates(), 0u);
}

TEST_F(Boosting, InOnePassTheIntervalCountsSearches) {
  options_.boosting.one_pass = true;
  add_tracklet({100, 100, 40, 90}, {100, 100, 40, 90});
  appearance_.people.clear();  // nobody is found
  for (const auto& [frame, searched] :
       std::vector<std::pair<int, bool>>{{10, true}, {11, false}, {12, true}}) {
    EXPECT_EQ(boost(frame), 0);
    EXPECT_EQ(boosting_.candidates() > 0, searched) << frame;
  }
}

}  // namespace
}  // namespace sdmt::track
