// SPDX-License-Identifier: Apache-2.0
#include "tracklet_association.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

namespace sdmt::track {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

class Association : public ::testing::Test {
 protected:
  // A tracklet that walks right by 2 pixels a frame and looks like a direction.
  Tracklet& add(int id, int first_frame, int last_frame, double first_left, double degrees = 0) {
    auto tracklet =
        std::make_unique<Tracklet>(id, first_frame, options_.appearance.gallery_size, rules_);
    tracklet->first_box = {first_left + 20, 100, 40, 90};
    tracklet->last_frame = tracklet->state_frame = last_frame;
    tracklet->state.mean = {first_left + 20 + 2.0 * (last_frame - first_frame), 100, 40, 90};
    tracklet->state.velocity = {2, 0, 0, 0};
    tracklet->misses = 1;
    for (int frame = first_frame; frame <= last_frame; ++frame) {
      mot::Cxcywh box = tracklet->first_box;
      box.cx += 2.0 * (frame - first_frame);
      tracklet->history.append(frame, box, box, 0.9, BoxSource::detected);
    }
    const double angle = degrees * 3.14159265358979 / 180;
    tracklet->gallery.add(std::vector<float>{static_cast<float>(std::cos(angle)),
                                             static_cast<float>(std::sin(angle))});
    tracklets_.push_back(std::move(tracklet));
    return *tracklets_.back();
  }

  // The merges (older, newer), by the ids before the run.
  std::vector<std::pair<int, int>> run(bool by_appearance = true, double threshold = 0.8) {
    const SceneReport scene{.association_threshold = threshold};
    TrackletAssociation association(options_.association, options_.motion, options_.appearance,
                                    by_appearance, scene);
    decisions_.clear();
    association.observer = [this](const AssociationDecision& decision) {
      decisions_.push_back(decision);
    };
    std::vector<Tracklet*> all;
    for (const auto& tracklet : tracklets_) all.push_back(tracklet.get());
    std::vector<std::pair<int, int>> merges;
    association.run(200, all, [&](Tracklet& older, Tracklet& newer) {
      merges.emplace_back(older.id, newer.id);
      newer.id = older.id;
      newer.first_frame = older.first_frame;
      newer.first_box = older.first_box;
      newer.gallery.prepend(older.gallery);
    });
    return merges;
  }

  AssociationVerdict verdict(int older, int newer) const {
    for (const auto& decision : decisions_) {
      if (decision.older == older && decision.newer == newer) return decision.verdict;
    }
    ADD_FAILURE() << "no decision about " << older << " and " << newer;
    return {};
  }

  TrackerOptions options_;
  OutputRules rules_{options_.output, options_.motion, options_.decision_lag()};
  std::vector<std::unique_ptr<Tracklet>> tracklets_;
  std::vector<AssociationDecision> decisions_;
};

TEST_F(Association, JoinsWhatFitsInTimePlaceAndLook) {
  add(1, 1, 20, 0);
  add(2, 40, 60, 80);  // the prediction for frame 40 is at 78
  EXPECT_THAT(run(), ElementsAre(Pair(1, 2)));
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::merged);
  EXPECT_NEAR(decisions_[0].affinity, 1, 1e-6);
  EXPECT_EQ(decisions_[0].gap, 20);
  EXPECT_EQ(decisions_[0].frame, 200);
}

TEST_F(Association, SaysWhyNot) {
  add(1, 1, 20, 0);
  add(2, 40, 60, 80, 45);
  EXPECT_THAT(run(), IsEmpty());
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::appearance);
  EXPECT_NEAR(decisions_[0].affinity, 1 - 2 * std::sin(22.5 * 3.14159265358979 / 180), 1e-5);
  options_.association.reach = 0;
  tracklets_.clear();
  add(1, 1, 20, 0);
  add(2, 40, 60, 78 + 40.001);  // boxes are 40 wide: they just miss each other
  EXPECT_THAT(run(), IsEmpty());
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::too_far);
  tracklets_[1]->first_box.cx -= 0.002;
  EXPECT_THAT(run(), ElementsAre(Pair(1, 2)));
  tracklets_.clear();
  add(1, 1, 20, 0);
  add(2, 40, 60, 80).gallery = AppearanceGallery(20);
  EXPECT_THAT(run(), IsEmpty());
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::no_feature);
}

TEST_F(Association, ByAppearanceReachesBeyondTheBox) {
  options_.association.reach = 1.5;
  const double reach = 1.5 * 90;  // pixels sideways
  for (const auto& [shift, joined] : std::vector<std::pair<double, bool>>{
           {reach - 0.01, true}, {reach + 0.01, false}, {-reach + 0.01, true}}) {
    tracklets_.clear();
    add(1, 1, 20, 0);
    add(2, 40, 60, 78 + shift);
    EXPECT_EQ(run().size(), joined ? 1u : 0u) << shift;
  }
}

TEST_F(Association, ByMotionTheyMustLeadToEachOtherAndBeAsTall) {
  options_.association.motion_reach = 0.5;
  for (const auto& [shift, joined] :
       std::vector<std::pair<double, bool>>{{44, true}, {46, false}, {-44, true}}) {
    tracklets_.clear();
    add(1, 1, 20, 0);
    add(2, 40, 60, 78 + shift);
    EXPECT_EQ(run(false).size(), joined ? 1u : 0u) << shift;
  }
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::merged);
  // Where it was expected, but it comes from elsewhere: as fast the other way.
  tracklets_.clear();
  add(1, 1, 20, 0);
  Tracklet& other = add(2, 40, 60, 78);
  other.history = TrackHistory(rules_);
  for (int frame = 40; frame <= 60; ++frame) {
    const mot::Cxcywh box{98 - 2.0 * (frame - 40), 100, 40, 90};
    other.history.append(frame, box, box, 0.9, BoxSource::detected);
  }
  EXPECT_THAT(run(false), IsEmpty());
  EXPECT_EQ(verdict(1, 2), AssociationVerdict::too_far);
  // A child is no grown-up.
  for (const auto& [height, joined] :
       std::vector<std::pair<double, bool>>{{61, true}, {59, false}, {134, true}, {136, false}}) {
    tracklets_.clear();
    add(1, 1, 20, 0);
    add(2, 40, 60, 78).first_box.height = height;
    EXPECT_EQ(run(false).size(), joined ? 1u : 0u) << height;
  }
}

TEST_F(Association, NeedsAGapWithinTheHorizon) {
  options_.motion.max_misses = 2;
  options_.association.horizon = 90;
  for (const auto& [first, joined] : std::vector<std::pair<int, bool>>{
           {19, false}, {20, false}, {21, true}, {112, true}, {113, false}}) {
    tracklets_.clear();
    add(1, 1, 20, 0);
    add(2, first, first + 10, 2.0 * (first - 1));
    EXPECT_EQ(run().size(), joined ? 1u : 0u) << first;
  }
  // A tracklet that has its detection in this frame is not lost.
  tracklets_.clear();
  add(1, 1, 20, 0).misses = 0;
  add(2, 40, 60, 80);
  EXPECT_THAT(run(), IsEmpty());
}

TEST_F(Association, TakesTheBestPairFirstAndJudgesAnew) {
  // Both older ones fit the newer one; the second looks more alike.
  add(1, 1, 20, 0, 8);
  add(2, 1, 20, 4, 4);
  add(3, 40, 60, 80, 0);
  EXPECT_THAT(run(), ElementsAre(Pair(2, 3)));
  EXPECT_EQ(verdict(1, 3), AssociationVerdict::better_pair);
  tracklets_.clear();
  add(1, 1, 20, 0, 8);
  add(2, 1, 20, 4, 4);
  add(3, 40, 60, 80, 0);
  options_.association.literal = true;
  EXPECT_THAT(run(), ElementsAre(Pair(1, 3)));
}

TEST_F(Association, ChainsPieces) {
  add(1, 1, 20, 0);
  add(2, 40, 60, 80, 5);
  add(3, 80, 100, 160);
  // 1 and 3 are too far apart in time only through 2's frames: 1-3 is a candidate too, and the best
  // pair by look. Then 2 fits no gap any more.
  EXPECT_THAT(run(), ElementsAre(Pair(1, 3)));
  tracklets_.clear();
  add(1, 1, 20, 0, 5);
  add(2, 40, 60, 80, 5);
  add(3, 80, 100, 160, 0);
  EXPECT_THAT(run(), ElementsAre(Pair(1, 2), Pair(1, 3)));
}

TEST_F(Association, ByMotionTheNearestWins) {
  add(1, 1, 20, 0, 0);
  add(2, 1, 20, 6, 90);
  add(3, 40, 60, 82, 0);  // predictions: 78 and 84
  EXPECT_THAT(run(false), ElementsAre(Pair(2, 3)));
  EXPECT_TRUE(std::isnan(decisions_[0].affinity));
}

TEST_F(Association, TiesGoToTheLowestIds) {
  add(1, 1, 20, 0);
  add(2, 1, 20, 0);
  add(3, 40, 60, 78);
  add(4, 40, 60, 78);
  EXPECT_THAT(run(), ElementsAre(Pair(1, 3), Pair(2, 4)));
}

}  // namespace
}  // namespace sdmt::track
