// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/adaptation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "sdmt/reid/embedder.h"
#include "train/training_fixture.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;

// People in two colours, in light that changes as they walk; `clothes` 0: all wear the same.
SceneCrops people(int tracks, int crops, double clothes, std::uint64_t seed) {
  nn::Random random(seed);
  SceneCrops result;
  result.met = Meetings(tracks);
  for (int track = 0; track < tracks; ++track) {
    for (int other = 0; other < track; ++other) result.met.add(track, other);
    nn::Random wardrobe(100, static_cast<std::uint64_t>(track));
    double colours[2][3];
    for (auto& colour : colours) {
      for (double& channel : colour) channel = 128 + clothes * wardrobe.uniform(-90, 90);
    }
    for (int k = 0; k < crops; ++k) {
      image::Image image(16, 32);
      const double light = random.uniform(0.6, 1.4);
      for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
          for (int c = 0; c < 3; ++c) {
            const double value = light * colours[y < image.height / 2 ? 0 : 1][c];
            image.pixel(x, y)[c] =
                static_cast<std::uint8_t>(std::clamp(value + random.uniform(-25, 25), 0.0, 255.0));
          }
        }
      }
      result.images.push_back(std::move(image));
      result.tracks.push_back(track);
    }
  }
  return result;
}

SceneLessons lessons(double clothes) {
  return {people(8, 12, clothes, 1), people(6, 10, clothes, 2), {}};
}

AdaptationOptions few_steps() {
  AdaptationOptions options;
  options.iterations = 15;
  options.tracks = 8;
  options.learning_rate = 1e-3;
  return options;
}

const auto kSilent = [](const AdaptationStep&) {};

std::vector<std::vector<float>> weights(const reid::Model& model) {
  std::vector<std::vector<float>> all;
  for (const auto& tensor : model.network.state()) {
    all.emplace_back(tensor.value->values().begin(), tensor.value->values().end());
  }
  return all;
}

TEST(Adaptation, LearnsAndTellsWhatTheModelThenDoes) {
  reid::Model model = small_model();
  const SceneLessons scene = lessons(1);
  AdaptationOptions options = few_steps();
  options.score_every = 3;
  std::vector<double> scored;
  const Adaptation result = adapt(model, scene, options, [&](const AdaptationStep& step) {
    if (step.scored != nullptr) scored.push_back(step.scored->auc());
  });
  EXPECT_TRUE(result.gained());
  EXPECT_GT(result.after.auc(), result.before.auc());
  // The latest with half of the largest gain until then.
  double most = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scored.size(); ++i) {
    most = std::max(most, scored[i] - result.before.auc());
    if (2 * (scored[i] - result.before.auc()) >= most && most > 0) kept = i;
  }
  EXPECT_EQ(result.after.auc(), scored[kept]);

  // By the way that the tracker goes.
  reid::Embedder embedder(std::move(model));
  std::vector<image::Crop> crops;
  for (const auto& image : scene.held_out.images) {
    crops.push_back({image.view(), {0, 0, 1.0 * image.width, 1.0 * image.height}});
  }
  image::DescriptorRows rows;
  embedder.describe(crops, rows);
  nn::Tensor vectors({static_cast<int>(crops.size()), 1, 1, rows.dimension});
  std::copy(rows.values.begin(), rows.values.end(), vectors.data());
  EXPECT_NEAR(scene_roc(scene.held_out, vectors).auc(), result.after.auc(), 1e-4);
}

TEST(Adaptation, IsTheSameForAnyNumberOfThreads) {
  std::vector<std::vector<std::vector<float>>> results;
  for (const int threads : {1, 3}) {
    omp_set_num_threads(threads);
    reid::Model model = small_model();
    adapt(model, lessons(1), few_steps(), kSilent);
    results.push_back(weights(model));
  }
  omp_set_num_threads(omp_get_num_procs());
  EXPECT_EQ(results[0], results[1]);
  EXPECT_NE(results[0], weights(small_model()));
}

TEST(Adaptation, KeepsTheStatisticsOfNormalisations) {
  reid::Model model = small_model();
  const auto before = weights(model);
  adapt(model, lessons(1), few_steps(), kSilent);
  const auto after = weights(model);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (model.network.state()[i].learnt == nullptr) {
      EXPECT_EQ(before[i], after[i]);
    }
  }
}

TEST(Adaptation, LeavesTheModelAsItWasWhenNothingIsThereToLearn) {
  reid::Model model = small_model();
  const auto before = weights(model);
  const Adaptation result = adapt(model, lessons(0), few_steps(), kSilent);
  EXPECT_FALSE(result.gained()) << result.before.auc() << " to " << result.after.auc();
  EXPECT_EQ(weights(model), before);
}

TEST(Adaptation, TheAnchorHolds) {
  // The mean squared distance to the start's vectors on people made up, at the end.
  const auto moved = [](double weight) {
    reid::Model model = small_model();
    AdaptationOptions options = few_steps();
    options.anchor_weight = weight;
    double last = 0;
    adapt(model, lessons(1), options, [&](const AdaptationStep& step) { last = step.anchor_loss; });
    return last;
  };
  EXPECT_LT(moved(10), 0.5 * moved(0));
}

TEST(Adaptation, RefusesWhatCannotTeach) {
  const auto refusal = [](SceneCrops teaching, SceneCrops held_out) {
    return message_of([&] {
      reid::Model model = small_model();
      adapt(model, {std::move(teaching), std::move(held_out), {}}, few_steps(), kSilent);
    });
  };
  const SceneCrops enough = people(6, 10, 1, 3);
  EXPECT_THAT(refusal({}, enough),
              HasSubstr("the part that teaches has 0 tracks of people who were seen together, "
                        "expected at least 4"));
  EXPECT_THAT(refusal(people(1, 40, 1, 4), enough), HasSubstr("has 0 tracks"));
  SceneCrops alone = people(8, 10, 1, 5);
  alone.met = Meetings(8);  // one after the other
  EXPECT_THAT(refusal(alone, enough), HasSubstr("has 0 tracks"));
  EXPECT_THAT(refusal(enough, people(4, 6, 1, 6)),
              HasSubstr("the part held out has 60 pairs of crops of one person, expected at least "
                        "200"));
}

TEST(Adaptation, StopsWhenProgressThrows) {
  reid::Model model = small_model();
  EXPECT_THROW(adapt(model, lessons(1), few_steps(),
                     [](const AdaptationStep&) { throw std::domain_error("enough"); }),
               std::domain_error);
}

TEST(Adaptation, RefusesWrongOptions) {
  const auto refusal = [](auto&& change) {
    return message_of([&] {
      AdaptationOptions options;
      change(options);
      options.validate();
    });
  };
  EXPECT_THAT(refusal([](auto& o) { o.iterations = 0; }), HasSubstr("iterations is 0"));
  EXPECT_THAT(refusal([](auto& o) { o.learning_rate = -1; }), HasSubstr("learning_rate is -1"));
  EXPECT_THAT(refusal([](auto& o) { o.anchor_weight = -1; }), HasSubstr("anchor_weight is -1"));
  EXPECT_THAT(refusal([](auto& o) { o.tracks = 1; }), HasSubstr("tracks is 1"));
}

}  // namespace
}  // namespace sdmt::train
