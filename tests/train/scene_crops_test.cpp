// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/scene_crops.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "scene_batches.h"
#include "sdmt/nn/random.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;

// Tracks that come and go and walk through one another.
std::vector<SceneBox> random_scene(std::uint64_t seed) {
  nn::Random random(seed);
  std::vector<SceneBox> boxes;
  for (int track = 1; track <= 9; ++track) {
    const int first = static_cast<int>(random.below(120)),
              frames = static_cast<int>(random.below(90));
    const double start = random.uniform(0, 300), speed = random.uniform(-3, 3);
    for (int frame = first; frame < first + frames; ++frame) {
      if (random.uniform() < 0.2) continue;  // not detected
      boxes.push_back(
          {frame, 100 * track, {start + speed * (frame - first), random.uniform(0, 9), 30, 80}});
    }
  }
  random.shuffle(std::span<SceneBox>(boxes));
  return boxes;
}

double common_area(const image::PixelRect& a, const image::PixelRect& b) {
  const double w = std::min(a.left + a.width, b.left + b.width) - std::max(a.left, b.left);
  const double h = std::min(a.top + a.height, b.top + b.height) - std::max(a.top, b.top);
  return std::max(w, 0.0) * std::max(h, 0.0);
}

TEST(SceneCrops, EvidenceIsWhatTheBoxesSay) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto boxes = random_scene(seed);
    const SceneCropOptions options{
        .gap = 4, .most_crops = 7, .fewest_crops = 4, .most_hidden = 0.3};
    const SceneEvidence evidence = find_evidence(boxes, options);
    ASSERT_EQ(evidence.boxes.size(), evidence.tracks.size());

    std::vector<int> name(static_cast<std::size_t>(evidence.met.tracks()), -1);
    std::vector<int> count(name.size(), 0);
    for (std::size_t i = 0; i < evidence.boxes.size(); ++i) {
      const SceneBox& box = boxes[evidence.boxes[i]];
      for (const SceneBox& other : boxes) {
        if (other.frame != box.frame || other.track == box.track) continue;
        EXPECT_LE(common_area(box.rect, other.rect), 0.3 * 30 * 80);
      }
      const int track = evidence.tracks[i];
      if (name[track] < 0) name[track] = box.track;
      EXPECT_EQ(name[track], box.track);
      ++count[track];
      if (i > 0 && evidence.tracks[i - 1] == track) {
        EXPECT_GE(box.frame - boxes[evidence.boxes[i - 1]].frame, 4);
      }
    }
    EXPECT_EQ(std::set<int>(name.begin(), name.end()).size(), name.size());
    for (const int crops : count) {
      EXPECT_GE(crops, 4);
      EXPECT_LE(crops, 7);
    }
    for (int a = 0; a < evidence.met.tracks(); ++a) {
      EXPECT_FALSE(evidence.met(a, a));
      for (int b = 0; b < a; ++b) {
        bool apart = false;
        for (const SceneBox& one : boxes) {
          for (const SceneBox& two : boxes) {
            apart = apart || (one.track == name[a] && two.track == name[b] &&
                              one.frame == two.frame && common_area(one.rect, two.rect) == 0);
          }
        }
        EXPECT_EQ(evidence.met(a, b), apart) << name[a] << " and " << name[b];
        EXPECT_EQ(evidence.met(b, a), apart);
      }
    }
  }
}

TEST(SceneCrops, ALongTrackIsSpreadOverItsTime) {
  std::vector<SceneBox> boxes;
  for (int frame = 1; frame <= 1000; ++frame) boxes.push_back({frame, 1, {0, 0, 10, 20}});
  const auto evidence = find_evidence(boxes, {.gap = 10, .most_crops = 7});
  std::vector<int> frames;
  for (const std::size_t box : evidence.boxes) frames.push_back(boxes[box].frame);
  EXPECT_THAT(frames, testing::ElementsAre(1, 161, 331, 491, 661, 821, 991));
}

TEST(SceneCrops, DoubledBoxesOfAPersonAreNoTwoPeople) {
  std::vector<SceneBox> boxes;
  for (int frame = 1; frame <= 60; ++frame) {
    boxes.push_back({frame, 1, {0, 0, 40, 100}});
    boxes.push_back({frame, 2, {25, 0, 40, 100}});  // overlaps, by less than hides
  }
  const auto evidence = find_evidence(boxes, {});
  ASSERT_EQ(evidence.met.tracks(), 2);
  EXPECT_FALSE(evidence.met(0, 1));
}

TEST(SceneCrops, OfNothingNothing) {
  EXPECT_EQ(find_evidence({}, {}).met.tracks(), 0);
  EXPECT_THAT([] { find_evidence({}, {.gap = 0}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("gap is 0")));
  EXPECT_THAT([] { find_evidence({}, {.most_crops = 4, .fewest_crops = 5}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("fewest_crops is 5")));
}

SceneCrops crops_of(std::vector<int> tracks, int count,
                    const std::vector<std::pair<int, int>>& meetings) {
  SceneCrops crops;
  crops.images.resize(tracks.size());
  crops.tracks = std::move(tracks);
  crops.met = Meetings(count);
  for (const auto& [a, b] : meetings) crops.met.add(a, b);
  return crops;
}

TEST(SceneCrops, ScenesHaveNotMet) {
  SceneCrops crops = crops_of({0, 0, 1}, 2, {{0, 1}});
  crops.append(crops_of({0, 1, 1}, 2, {{1, 0}}));
  EXPECT_THAT(crops.tracks, testing::ElementsAre(0, 0, 1, 2, 3, 3));
  EXPECT_TRUE(crops.met(0, 1));
  EXPECT_TRUE(crops.met(2, 3));
  for (const int a : {0, 1}) {
    for (const int b : {2, 3}) EXPECT_FALSE(crops.met(a, b) || crops.met(b, a));
  }
  EXPECT_EQ(count_pairs(crops).same, 2U);
  EXPECT_EQ(count_pairs(crops).different, 4U);
}

TEST(SceneCrops, TracksThatNeverMetAreOnNeitherSideOfTheCurve) {
  const SceneCrops crops = crops_of({0, 0, 1, 2}, 3, {{0, 1}});
  nn::Tensor points({4, 1, 1, 1});
  const float at[] = {0.0F, 0.1F, 0.5F, 0.0F};  // track 2 lies on track 0
  std::copy(std::begin(at), std::end(at), points.data());
  const reid::Roc roc = scene_roc(crops, points);
  EXPECT_EQ(roc.positives(), 1);
  EXPECT_EQ(roc.negatives(), 2);
  EXPECT_EQ(roc.auc(), 1);
}

TEST(SceneBatches, CropsAreFarApartAndTracksHaveMet) {
  std::vector<int> tracks;
  for (int track = 0; track < 6; ++track) tracks.insert(tracks.end(), 12, track);
  // 0, 1, 2 have met in a chain, so have 3, 4, 5.
  const SceneCrops crops = crops_of(tracks, 6, {{0, 1}, {1, 2}, {3, 4}, {4, 5}});
  const SceneBatches batches(crops, 3, 4, 7);
  std::set<int> drawn;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const auto batch = batches.batch(iteration);
    ASSERT_EQ(batch.images.size(), 12U);
    for (std::size_t i = 0; i < 12; ++i) {
      drawn.insert(batch.images[i]);
      EXPECT_EQ(batch.labels[i], crops.tracks[batch.images[i]]);
      EXPECT_EQ(batch.images[i] % 12 / 3, static_cast<int>(i % 4));  // a quarter of the time each
      EXPECT_EQ(batch.labels[i] / 3, batch.labels[0] / 3);           // the three who have met
    }
    EXPECT_EQ(batch.images, batches.batch(iteration).images);
  }
  EXPECT_EQ(drawn.size(), crops.tracks.size());
}

}  // namespace
}  // namespace sdmt::train
