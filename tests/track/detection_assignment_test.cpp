// SPDX-License-Identifier: Apache-2.0
#include "detection_assignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace sdmt::track {
namespace {

constexpr double kThreshold = 0.8;

std::vector<float> look(double degrees) {
  const double angle = degrees * 3.14159265358979 / 180;
  return {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))};
}

class Assignment : public ::testing::Test {
 protected:
  Assignment() {
    options_.assignment.rescale_affinity = false;
    options_.appearance.gallery_distance = GalleryDistance::mean;
  }

  void add_tracklet(const mot::Tlwh& box, std::vector<double> looks = {}) {
    auto tracklet = std::make_unique<Tracklet>(static_cast<int>(active_.size()) + 1, 1,
                                               options_.appearance.gallery_size, rules_);
    const mot::Cxcywh centre = mot::to_cxcywh(box);
    tracklet->state.mean = {centre.cx, centre.cy, centre.width, centre.height};
    for (const double degrees : looks) tracklet->gallery.add(look(degrees));
    active_.push_back(std::move(tracklet));
  }
  void add_detection(const mot::Tlwh& box, bool strong = true) {
    FrameDetections::Flags flags;
    flags.strong = strong;
    detections_.add(box, strong ? 0.9 : 0.3, flags);
  }
  void add_detection(const mot::Tlwh& box, double degrees) {
    add_detection(box);
    detections_.set_feature(detections_.size() - 1, look(degrees));
  }

  // [tracklets] the detection of each, -1 for none.
  std::vector<int> assign() {
    const SceneReport scene{.assignment_threshold = kThreshold};
    DetectionAssignment assignment(options_.assignment, options_.appearance, scene);
    assignment.gate(active_, detections_);
    std::vector<int> given(active_.size(), -1);
    matches_ = assignment.assign(active_, detections_);
    for (const Match& match : matches_) {
      EXPECT_EQ(given[static_cast<std::size_t>(match.tracklet)], -1);
      given[static_cast<std::size_t>(match.tracklet)] = match.detection;
    }
    return given;
  }

  TrackerOptions options_;
  OutputRules rules_{options_.output, options_.motion, options_.decision_lag()};
  Tracklets active_;
  FrameDetections detections_;
  std::vector<Match> matches_;
};

using Given = std::vector<int>;

TEST_F(Assignment, MotionGateIsStrict) {
  options_.assignment.min_iou = 0.5;
  add_tracklet({0, 0, 10, 20});
  add_detection({0, 0, 10, 10});  // IoU 0.5 exactly
  EXPECT_EQ(assign(), Given{-1});
  options_.assignment.min_iou = 0.49;
  EXPECT_EQ(assign(), Given{0});
  EXPECT_DOUBLE_EQ(matches_[0].affinity, 0.5);
}

TEST_F(Assignment, TakesTheBestTotalNotTheBestPair) {
  // The first tracklet fits both boxes, the second only the one that the first fits best.
  add_tracklet({0, 0, 100, 100});
  add_tracklet({30, 0, 100, 100});
  add_detection({10, 0, 100, 100});
  add_detection({-20, 0, 100, 100});
  EXPECT_EQ(assign(), (Given{1, 0}));
}

TEST_F(Assignment, AppearanceForbidsAStranger) {
  add_tracklet({0, 0, 100, 100}, {0});
  add_detection({0, 0, 100, 100}, 90.0);
  EXPECT_EQ(assign(), Given{-1});
  options_.assignment.appearance_gate = false;
  options_.assignment.lambda = 0;
  EXPECT_EQ(assign(), Given{0});
  // Without the gate a pair of affinity <= 0 is still not matched: here 0.9 * (1 - sqrt 2) + 0.1.
  options_.assignment.lambda = 0.9;
  EXPECT_EQ(assign(), Given{-1});
}

TEST_F(Assignment, AppearanceGateIsStrictOnTheMeanOverTheGallery) {
  options_.appearance.gallery_distance = GalleryDistance::mean;
  // Distance of unit vectors: 2 sin(angle / 2). 5 and 17 degrees: 0.0872 and 0.2956, mean 0.191.
  add_tracklet({0, 0, 100, 100}, {-5, -17});
  add_detection({0, 0, 100, 100}, 0.0);
  EXPECT_EQ(assign(), Given{0});
  EXPECT_NEAR(matches_[0].affinity, 0.5 * (1 - (0.08724 + 0.29562) / 2) + 0.5, 1e-4);
  active_.clear();
  add_tracklet({0, 0, 100, 100}, {-5, -20});  // mean 0.217
  EXPECT_EQ(assign(), Given{-1});
  options_.appearance.gallery_distance = GalleryDistance::nearest;
  EXPECT_EQ(assign(), Given{0});
}

TEST_F(Assignment, LambdaWeighsAppearanceAgainstMotion) {
  add_tracklet({0, 0, 100, 100}, {0});
  add_detection({10, 0, 100, 100}, 10.0);  // closer: IoU 0.82, affinity 0.83
  add_detection({35, 0, 100, 100}, 0.0);   // more alike: IoU 0.48, affinity 1
  options_.assignment.lambda = 0;
  EXPECT_EQ(assign(), Given{0});
  options_.assignment.lambda = 1;
  EXPECT_EQ(assign(), Given{1});
  // Literally, the narrow range of appearance leaves the choice to motion; rescaled it counts.
  options_.assignment.lambda = 0.5;
  EXPECT_EQ(assign(), Given{0});
  options_.assignment.rescale_affinity = true;
  EXPECT_EQ(assign(), Given{1});
  EXPECT_NEAR(matches_[0].affinity, 0.5 * 1 + 0.5 * (65.0 / 135 - 0.3) / 0.7, 1e-6);
}

TEST_F(Assignment, WithoutAppearanceMotionDecides) {
  add_tracklet({0, 0, 100, 100});  // no state stored
  add_tracklet({500, 0, 100, 100}, {0});
  add_detection({0, 0, 100, 100}, 90.0);
  add_detection({500, 0, 100, 100});  // no crop
  EXPECT_EQ(assign(), (Given{0, 1}));
}

TEST_F(Assignment, WeakDetectionsGetWhatIsLeft) {
  add_tracklet({0, 0, 100, 100});
  add_tracklet({300, 0, 100, 100});
  add_detection({0, 0, 100, 100}, false);  // fits perfectly, but is weak
  add_detection({20, 0, 100, 100}, true);
  add_detection({320, 0, 100, 100}, false);
  EXPECT_EQ(assign(), (Given{1, 2}));
  options_.assignment.weak_iou = 0.7;  // 80 / 120 is less
  EXPECT_EQ(assign(), (Given{1, -1}));
}

TEST_F(Assignment, DroppedBoxesAreNotThere) {
  add_tracklet({0, 0, 100, 100});
  add_detection({0, 0, 100, 100});
  detections_.flags[0].dropped = true;
  EXPECT_EQ(assign(), Given{-1});
}

TEST_F(Assignment, TiesGoToTheOldestTracklet) {
  add_tracklet({0, 0, 100, 100});
  add_tracklet({0, 0, 100, 100});
  add_detection({0, 0, 100, 100});
  EXPECT_EQ(assign(), (Given{0, -1}));
}

}  // namespace
}  // namespace sdmt::track
