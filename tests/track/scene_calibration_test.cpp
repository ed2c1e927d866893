// SPDX-License-Identifier: Apache-2.0
#include "scene_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "affinity_histogram.h"
#include "scene.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/tracker.h"

namespace sdmt::track {
namespace {

constexpr double kBin = 0.002;

TEST(AffinityHistogram, IsTheSortedObservations) {
  nn::Random random(5);
  AffinityHistogram histogram;
  std::vector<double> all;
  for (int i = 0; i < 20'000; ++i) {
    all.push_back(std::clamp(0.7 + 0.1 * random.normal(), -1.0, 1.0));
    histogram.add(all.back());
  }
  std::sort(all.begin(), all.end(), std::greater<>());
  EXPECT_EQ(histogram.count(), 20'000);
  for (const double share : {0.001, 0.01, 0.05, 0.1, 0.5, 0.99}) {
    const double exact = all[static_cast<std::size_t>(share * 20'000)];
    EXPECT_NEAR(histogram.exceeded_by(share), exact, kBin) << share;
    EXPECT_NEAR(histogram.share_above(exact), share, 0.01) << share;
  }
}

TEST(AffinityHistogram, ForgetsSlowlyInBoundedMemory) {
  AffinityHistogram histogram;
  for (int i = 0; i < 200'000; ++i) histogram.add(0.2);
  EXPECT_LT(histogram.count(), 1 << 16);
  for (int i = 0; i < 600'000; ++i) histogram.add(0.8);
  EXPECT_GT(histogram.exceeded_by(0.99), 0.79);
}

// People who walk without touching, in clothes that are `alike` (0: nothing in common, 1: the
// same), and look a little different in every picture.
class Crowd final : public image::CropDescriptor {
 public:
  static constexpr int kDimension = 24, kPeople = 16;

  explicit Crowd(double alike, std::uint64_t seed = 1) : random_(seed) {
    const auto common = direction();
    for (int i = 0; i < kPeople; ++i) {
      auto own = direction();
      for (int k = 0; k < kDimension; ++k) own[k] = alike * common[k] + (1 - alike) * own[k];
      looks_.push_back(own);
    }
  }
  std::string name() const override { return "crowd"; }
  int dimension() const override { return kDimension; }
  std::optional<double> tau_a() const override { return threshold; }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    out.reset(crops.size(), kDimension);
    for (std::size_t i = 0; i < crops.size(); ++i) {
      const auto vector = view(static_cast<int>(crops[i].rect.top / 100));
      std::copy(vector.begin(), vector.end(), out.row(i).begin());
      out.valid[i] = 1;
    }
  }
  // A picture of a person, who walks in a row of their own.
  std::vector<float> view(int person) {
    const auto noise = direction();
    std::vector<float> vector(kDimension);
    double squares = 0;
    for (int k = 0; k < kDimension; ++k) {
      const double value = looks_[person][k] + 0.25 * noise[k];
      vector[k] = static_cast<float>(value);
      squares += value * value;
    }
    for (float& value : vector) value = static_cast<float>(value / std::sqrt(squares));
    return vector;
  }
  std::vector<mot::Detection> seen(int frame) {
    std::vector<mot::Detection> boxes;
    for (int i = 0; i < kPeople; ++i) {
      if (random_.uniform() < 0.05) continue;
      boxes.push_back({{100.0 + 2 * frame, 100.0 * i + 6, 40, 90}, 0.9});
    }
    return boxes;
  }

  std::optional<double> threshold = 0.6;

 private:
  std::vector<double> direction() {
    std::vector<double> vector(kDimension);
    double squares = 0;
    for (double& value : vector) {
      value = random_.normal();
      squares += value * value;
    }
    for (double& value : vector) value /= std::sqrt(squares);
    return vector;
  }

  nn::Random random_;
  std::vector<std::vector<double>> looks_;
};

std::set<int> run(Tracker& tracker, Crowd& crowd, int frames) {
  std::set<int> ids;
  const auto take = [&](const std::vector<FinishedFrame>& finished) {
    for (const FinishedFrame& frame : finished) {
      for (const TrackedBox& box : frame.boxes) ids.insert(box.id);
    }
  };
  const image::ImageView image = test::blank();
  for (int frame = 1; frame <= frames; ++frame) take(tracker.update(crowd.seen(frame), &image));
  take(tracker.finish());
  return ids;
}

// The share of strangers that passes is the share that was asked for, whatever the model thinks.
TEST(SceneCalibration, KeepsTheFalseMatchRate) {
  for (const double alike : {0.0, 0.5, 0.9}) {
    for (const double asked : {0.01, 0.05, 0.1}) {
      Crowd crowd(alike);
      crowd.threshold = 0.3 + alike / 2;
      TrackerOptions options;
      options.scene.learning = SceneLearning::on;
      options.scene.false_match_rate = asked;
      // The gate of assignment is opened for a person's own boxes; what is asked shows when
      // joining.
      Tracker tracker(options, &crowd);
      run(tracker, crowd, 600);
      int passed = 0, pairs = 0;
      for (int repeat = 0; repeat < 40; ++repeat) {
        std::vector<AppearanceGallery> galleries;
        for (int i = 0; i < Crowd::kPeople; ++i) {
          galleries.emplace_back(options.appearance.gallery_size);
          for (int k = 0; k < options.appearance.gallery_size; ++k) {
            galleries.back().add(crowd.view(i));
          }
        }
        for (int i = 0; i < Crowd::kPeople; ++i) {
          for (int j = 0; j < i; ++j, ++pairs) {
            const double affinity =
                1 - galleries[i].distance(galleries[j], options.appearance.gallery_distance);
            passed += affinity > tracker.scene().association_threshold ? 1 : 0;
          }
        }
      }
      const double reached = static_cast<double>(passed) / pairs;
      EXPECT_LT(reached, 1.6 * asked) << alike;
      EXPECT_GT(reached, asked / 1.6) << alike;
    }
  }
}

TEST(SceneCalibration, WhereAllLookAlikeAppearanceLosesItsSay) {
  for (const double wrong : {-0.05, 0.0}) {
    Crowd crowd(1.0);
    crowd.threshold = 0.78 + wrong;
    TrackerOptions options;
    options.scene.learning = SceneLearning::on;
    Tracker tracker(options, &crowd);
    EXPECT_LE(run(tracker, crowd, 400).size(), std::size_t{Crowd::kPeople} + 2);
    EXPECT_LT(tracker.scene().say, 0.2);
    EXPECT_TRUE(tracker.scene().all_look_alike());
  }
  Crowd colourful(0.0);
  TrackerOptions options;
  options.scene.learning = SceneLearning::on;
  Tracker tracker(options, &colourful);
  EXPECT_EQ(run(tracker, colourful, 400).size(), std::size_t{Crowd::kPeople});
  EXPECT_GT(tracker.scene().say, 0.9);
}

TEST(SceneCalibration, OffItIsTheModelsThreshold) {
  Crowd crowd(0.5);
  TrackerOptions options;
  options.scene.learning = SceneLearning::off;
  Tracker tracker(options, &crowd);
  run(tracker, crowd, 100);
  const double model = *crowd.threshold - options.appearance.tau_a_margin;
  EXPECT_EQ(tracker.scene().assignment_threshold, model);
  EXPECT_EQ(tracker.scene().association_threshold, model);
  EXPECT_EQ(tracker.scene().say, 1);
  EXPECT_EQ(tracker.scene().strangers, 0);
}

TEST(SceneCalibration, FrozenItKeepsWhatASnapshotKnows) {
  Crowd crowd(0.5);
  TrackerOptions options;
  options.scene.learning = SceneLearning::on;
  Tracker tracker(options, &crowd);
  const image::ImageView image = test::blank();
  for (int frame = 1; frame <= 200; ++frame) tracker.update(crowd.seen(frame), &image);
  options.scene.learning = SceneLearning::frozen;
  Tracker frozen(options, &crowd);
  frozen.restore(tracker.save());
  EXPECT_EQ(frozen.scene().association_threshold, tracker.scene().association_threshold);
  for (int frame = 201; frame <= 260; ++frame) frozen.update(crowd.seen(frame), &image);
  EXPECT_EQ(frozen.scene().association_threshold, tracker.scene().association_threshold);
  EXPECT_EQ(frozen.scene().strangers, tracker.scene().strangers);
  EXPECT_GT(frozen.scene().strangers, 1000);
}

TEST(SceneCalibration, CountsWhichScoresWerePeople) {
  Tracker tracker;
  for (int frame = 1; frame <= 100; ++frame) {
    // A person, a doubtful box that nothing follows, and somebody who is there for three frames.
    std::vector<mot::Detection> boxes{{{100, 100, 40, 90}, 0.95},
                                      {{400.0 + 100 * frame, 100, 40, 90}, 0.35}};
    if (frame % 20 < 3) boxes.push_back({{100, 400.0 + 200 * (frame / 20), 40, 90}, 0.75});
    tracker.update(boxes);
  }
  tracker.finish();
  const auto& scores = tracker.scene().scores;
  EXPECT_EQ(scores[9].boxes, 100);
  EXPECT_EQ(scores[9].people, 100);
  EXPECT_EQ(scores[3].boxes, 100);
  EXPECT_EQ(scores[3].people, 0);
  EXPECT_GE(scores[7].boxes, 12);
  EXPECT_EQ(scores[7].people, 0);
}

}  // namespace
}  // namespace sdmt::track
