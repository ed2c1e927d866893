// SPDX-License-Identifier: Apache-2.0
#include "embedding_selection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace sdmt::track {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Selection : public ::testing::Test {
 protected:
  Selection() { options_.appearance.embed = EmbedPolicy::needed; }

  Tracklet& add_tracklet(int length = 6, int feature_frame = 99) {
    auto tracklet = std::make_unique<Tracklet>(1, 1, options_.appearance.gallery_size, rules_);
    for (int i = 0; i < length; ++i) tracklet->confidence.add(1, 1);
    tracklet->gallery.add(std::vector<float>{1});
    tracklet->feature_frame = feature_frame;
    active_.push_back(std::move(tracklet));
    return *active_.back();
  }
  void add_detection(bool strong = true) {
    FrameDetections::Flags flags;
    flags.strong = strong;
    detections_.add({}, 1, flags);
  }
  const std::vector<std::size_t>& choose(int frame = 100, bool everybody = false) {
    clear_.find(gated_, active_.size(), detections_.size(), options_.assignment.min_iou);
    return selection_.choose(frame, everybody, active_, detections_, clear_);
  }

  TrackerOptions options_;
  OutputRules rules_{options_.output, options_.motion, options_.decision_lag()};
  Tracklets active_;
  FrameDetections detections_;
  std::vector<mot::Overlap> gated_;
  ClearPairs clear_;
  EmbeddingSelection selection_{options_.appearance, options_.confidence};
};

TEST_F(Selection, AlwaysMeansEveryStrongDetection) {
  options_.appearance.embed = EmbedPolicy::always;
  add_tracklet();
  add_detection();
  add_detection(false);
  add_detection();
  gated_ = {{0, 0, 0.9}};
  EXPECT_THAT(choose(), ElementsAre(0, 2));
}

TEST_F(Selection, WhatContinuesAKnownTrackletIsLeftOut) {
  add_tracklet();
  add_detection();
  gated_ = {{0, 0, 0.9}};
  EXPECT_THAT(choose(), IsEmpty());
}

TEST_F(Selection, BirthsAreLookedAt) {
  add_tracklet();
  add_detection();
  EXPECT_THAT(choose(), ElementsAre(0));
}

TEST_F(Selection, AmbiguityIsLookedAt) {
  add_tracklet();
  add_tracklet();
  add_detection();
  add_detection();
  gated_ = {{0, 0, 0.9}, {1, 0, 0.4}, {1, 1, 0.9}};  // two tracklets at one detection and reverse
  EXPECT_THAT(choose(), ElementsAre(0, 1));
  gated_ = {{0, 0, 0.9}, {1, 1, 0.9}};
  EXPECT_THAT(choose(), IsEmpty());
}

TEST_F(Selection, YoungAndStaleTrackletsAreLookedAt) {
  add_detection();
  gated_ = {{0, 0, 0.9}};
  add_tracklet(5);
  EXPECT_THAT(choose(), ElementsAre(0));
  active_.clear();
  add_tracklet(6, 95);
  EXPECT_THAT(choose(), IsEmpty());
  active_.clear();
  add_tracklet(6, 94);  // embed_refresh is 6
  EXPECT_THAT(choose(), ElementsAre(0));
  active_.clear();
  add_tracklet().gallery = AppearanceGallery(20);
  EXPECT_THAT(choose(), ElementsAre(0));
}

TEST_F(Selection, WhoBarelyPassesTheGateIsLookedAt) {
  add_tracklet();
  add_detection();
  gated_ = {{0, 0, 0.44}};  // min_iou is 0.3
  EXPECT_THAT(choose(), ElementsAre(0));
  gated_ = {{0, 0, 0.46}};
  EXPECT_THAT(choose(), IsEmpty());
}

TEST_F(Selection, WhoReturnsIsLookedAt) {
  add_tracklet().misses = 1;
  add_detection();
  gated_ = {{0, 0, 0.9}};
  EXPECT_THAT(choose(), ElementsAre(0));
}

TEST_F(Selection, EverybodyIsLookedAtWhenTheirTimeHasCome) {
  add_tracklet(6, 101);
  add_tracklet(6, 99);
  add_detection();
  add_detection();
  gated_ = {{0, 0, 0.9}, {1, 1, 0.9}};
  EXPECT_THAT(choose(101), IsEmpty());
  EXPECT_THAT(choose(101, true), ElementsAre(0, 1));
}

}  // namespace
}  // namespace sdmt::track
