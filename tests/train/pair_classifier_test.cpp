// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/pair_classifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <vector>

#include "reid/temporary_data.h"
#include "sdmt/nn/random.h"
#include "sdmt/train/trainer.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr nn::Shape kMap{1, 8, 2, 4};  // one position a block: blocks are the map itself

nn::Tensor random_maps(int n, std::uint64_t seed) {
  nn::Random random(seed);
  nn::Tensor maps({n, kMap.h, kMap.w, kMap.c});
  for (float& v : maps.values()) v = static_cast<float>(random.normal());
  return maps;
}

PairClassifier initialized() {
  PairClassifier classifier(kMap);
  classifier.initialize(3);
  return classifier;
}

TEST(PairClassifier, VerdictIsSymmetricAndAgreesWithTheSoftmaxOfTheScores) {
  auto classifier = initialized();
  const nn::Tensor features = classifier.features_of_maps(random_maps(4, 1));
  const std::vector<FeaturePair> pairs = {{0, 1}, {1, 0}, {2, 3}, {3, 3}};
  const nn::Tensor scores = classifier.forward_pairs(features, pairs, nn::Mode::inference);
  for (int p = 0; p < 4; ++p) {
    const auto& pair = pairs[static_cast<std::size_t>(p)];
    const double other = std::exp(scores.image(p)[0]);
    const double same = std::exp(scores.image(p)[1]);
    const float d = classifier.distance(features.image(pair.first), features.image(pair.second));
    EXPECT_NEAR(d, other / (other + same), 1e-5);
    EXPECT_EQ(d, classifier.distance(features.image(pair.second), features.image(pair.first)));
  }
  EXPECT_EQ(scores.image(0)[1], scores.image(1)[1]);
}

TEST(PairClassifier, CrossEntropyByHand) {
  nn::Tensor scores({2, 1, 1, 2});
  scores.image(0)[1] = 2.0F;    // right by 2
  scores.image(1)[1] = 500.0F;  // wrong by 500: must not overflow
  nn::Tensor gradient;
  const double loss = softmax_cross_entropy(scores, {true, false}, gradient);
  EXPECT_NEAR(loss, 0.5 * std::log1p(std::exp(-2.0)) + 0.5 * 500, 1e-6);
  EXPECT_NEAR(gradient.image(0)[1], -0.5 / (1 + std::exp(2.0)), 1e-7);
  EXPECT_NEAR(gradient.image(0)[0], 0.5 / (1 + std::exp(2.0)), 1e-7);
  EXPECT_NEAR(gradient.image(1)[0], -0.5, 1e-7);
}

// The loss of fixed pairs, in training mode.
double loss_of(PairClassifier& classifier, const nn::Tensor& blocks, const LabelledPairs& pairs,
               nn::Tensor& d_scores) {
  const nn::Tensor& features = classifier.forward_features(blocks, nn::Mode::training);
  return softmax_cross_entropy(classifier.forward_pairs(features, pairs.pairs, nn::Mode::training),
                               pairs.same, d_scores);
}

TEST(PairClassifier, GradientsAgreeWithDifferences) {
  auto classifier = initialized();
  const nn::Tensor blocks = random_maps(6, 2);
  const LabelledPairs pairs = {{{0, 1}, {2, 3}, {4, 0}, {5, 1}}, {true, true, false, false}};
  nn::Tensor d_scores;
  loss_of(classifier, blocks, pairs, d_scores);
  classifier.backward(d_scores);
  nn::Random random(4);
  for (const auto& [name, parameter] : classifier.parameters()) {
    ASSERT_EQ(parameter->grad.size(), parameter->value.size()) << name;
    double checked = 0;
    double error = 0;
    for (int k = 0; k < 12; ++k) {
      const auto at = random.below(parameter->value.size());
      const float kept = parameter->value.data()[at];
      constexpr float kStep = 2e-3F;
      nn::Tensor unused;
      parameter->value.data()[at] = kept + kStep;
      classifier.parameters_changed();
      const double up = loss_of(classifier, blocks, pairs, unused);
      parameter->value.data()[at] = kept - kStep;
      classifier.parameters_changed();
      const double down = loss_of(classifier, blocks, pairs, unused);
      parameter->value.data()[at] = kept;
      classifier.parameters_changed();
      const double expected = (up - down) / (2.0 * kStep);
      error += std::abs(expected - parameter->grad.data()[at]);
      checked += std::abs(expected);
    }
    // Float32 and kinks of |a - b| and ReLU: within a few per cent on average.
    EXPECT_LT(error, 0.05 * checked + 2e-3) << name;
  }
}

TEST(PairClassifier, DrawsAsManyPairsOfOneAsOfTwo) {
  const std::vector<int> labels = {0, 0, 1, 1, 2, 2};
  const std::vector<int> images = {10, 11, 12, 13, 14, 14};  // the last person has one image
  nn::Random random(5);
  std::set<int> partners;
  for (int trial = 0; trial < 50; ++trial) {
    const auto drawn = draw_pairs(labels, images, random);
    ASSERT_EQ(drawn.pairs.size(), 10u);  // 6 of two people, 4 of one
    for (std::size_t p = 0; p < drawn.pairs.size(); ++p) {
      const auto a = static_cast<std::size_t>(drawn.pairs[p].first);
      const auto b = static_cast<std::size_t>(drawn.pairs[p].second);
      EXPECT_EQ(drawn.same[p], labels[a] == labels[b]);
      EXPECT_NE(images[a], images[b]);
      if (a == 0 && !drawn.same[p]) partners.insert(drawn.pairs[p].second);
    }
  }
  EXPECT_EQ(partners, (std::set<int>{2, 3, 4, 5}));
}

TEST(PairClassifier, SurvivesItsFile) {
  const auto path =
      std::filesystem::temp_directory_path() / "sdmt_pair_classifier_test.safetensors";
  reid::Model model;
  model.network.initialize(1);
  const auto map = model.network.trunk().output_shape(model.network.input_shape(1));
  PairClassifier classifier(map);
  classifier.initialize(7);
  save_pair_classifier(path, model, classifier, reid::Storage::float16);
  reid::Model read;
  auto again = load_pair_classifier(path, read);
  std::vector<float> a(PairClassifier::kFeatures, 0.3F);
  std::vector<float> b(PairClassifier::kFeatures, -0.2F);
  EXPECT_EQ(classifier.distance(a.data(), b.data()), again.distance(a.data(), b.data()));
  reid::save_model(path, model, reid::Storage::int8);
  EXPECT_THAT([&] { load_pair_classifier(path, read); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("holds no pair classifier")));
  std::filesystem::remove(path);
}

// Two colours of people, plain to see: the classifier must learn them.
TrainingSet coloured_people() {
  TrainingSet set;
  nn::Random random(6);
  const auto add = [&](std::vector<image::Image>& images, int person) {
    image::Image image(16, 32);
    for (std::size_t i = 0; i < image.bgr.size(); ++i) {
      const auto channel = i % 3;
      const int level = (person >> channel & 1) != 0 ? 200 : 60;
      image.bgr[i] = static_cast<std::uint8_t>(level + static_cast<int>(random.below(40)));
    }
    images.push_back(std::move(image));
  };
  set.sources = {"colours"};
  for (int person = 0; person < 8; ++person) {
    Identity identity{0, person, {}};
    for (int k = 0; k < 3; ++k) {
      identity.images.push_back(static_cast<int>(set.images.size()));
      add(set.images, person);
    }
    set.identities.push_back(identity);
  }
  ValidationSet validation;
  validation.name = "colours";
  for (int person = 0; person < 8; ++person) {
    for (int k = 0; k < 2; ++k) {
      add(validation.images, person);
      validation.labels.push_back(person);
    }
  }
  set.validation.push_back(std::move(validation));
  return set;
}

reid::Model small_model() { return reid::untrained_model(reid::vgg16(32, 16), 1); }

TrainerOptions options_for_colours(std::int64_t iterations) {
  TrainerOptions options;
  options.iterations = iterations;
  options.identities = 8;
  options.instances = 2;
  options.views = 1;
  options.validate_every = iterations;
  return options;
}

TEST(PairClassifier, LearnsToTellColoursApart) {
  reid::Model model = small_model();
  TrainerOptions options = options_for_colours(60);
  double auc = 0;
  std::int64_t steps = 0;
  PairTrainingEvents events;
  events.caching = [](std::int64_t, std::int64_t) {};
  events.step = [&](const PairTrainingStep& step) {
    ++steps;
    if (!step.auc.empty()) auc = step.auc.front().second;
  };
  train_pair_classifier(model, coloured_people(), options, events);
  EXPECT_EQ(steps, 60);
  EXPECT_GT(auc, 0.97);

  options.views = 0;
  EXPECT_THAT([&] { train_pair_classifier(model, coloured_people(), options, events); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("expected views >= 1")));
}

TEST(PairClassifier, TakesTheFeaturesThatATrainingOfTheHeadCached) {
  const reid::TemporaryData folder;
  const auto file = folder.path() / "features";
  reid::Model model = small_model();
  TrainerOptions options = options_for_colours(5);
  options.first_trained = "fc1";
  Trainer(model, coloured_people(), options).prepare({}, file);
  const auto written = std::filesystem::last_write_time(file);

  const auto losses = [&](const std::filesystem::path& cache_file) {
    std::vector<double> result;
    PairTrainingEvents events;
    events.step = [&](const PairTrainingStep& step) { result.push_back(step.loss); };
    train_pair_classifier(model, coloured_people(), options, events, cache_file);
    return result;
  };
  EXPECT_EQ(losses(file), losses({}));
  EXPECT_EQ(std::filesystem::last_write_time(file), written);
  options.seed = 1;
  EXPECT_THAT([&] { losses(file); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("features: made with seed = 0")));
}

}  // namespace
}  // namespace sdmt::train
