// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/batch_hard_loss.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;

struct Batch {
  std::size_t dim = 5;
  std::vector<double> embeddings;
  std::vector<int> labels;
  std::vector<int> samples;

  Strangers strangers;

  BatchHardResult loss(const BatchHardOptions& options, std::vector<double>& gradient) const {
    gradient.assign(embeddings.size(), 0.0);
    return batch_hard_loss<double>(embeddings, labels, samples, options, gradient, strangers);
  }
};

// Random points of people with `instances` images each, close enough that the margin matters.
Batch random_batch(int people, int instances, double radius, std::uint64_t seed) {
  nn::Random random(seed);
  Batch batch;
  for (int person = 0; person < people; ++person) {
    for (int k = 0; k < instances; ++k) {
      batch.labels.push_back(person);
      batch.samples.push_back(person * instances + k);
      for (std::size_t d = 0; d < batch.dim; ++d) {
        batch.embeddings.push_back(radius * random.normal());
      }
    }
  }
  return batch;
}

// The definition, written down without any thought of speed or gradients.
double contrastive_by_definition(const Batch& batch, double margin) {
  const std::size_t n = batch.labels.size();
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double farthest = -1;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < n; ++j) {
      double squared = 0;
      for (std::size_t d = 0; d < batch.dim; ++d) {
        const double difference =
            batch.embeddings[i * batch.dim + d] - batch.embeddings[j * batch.dim + d];
        squared += difference * difference;
      }
      const double distance = std::sqrt(squared + 1e-12);
      if (batch.labels[i] != batch.labels[j] &&
          (!batch.strangers || batch.strangers(batch.labels[i], batch.labels[j]))) {
        nearest = std::min(nearest, distance);
      }
      if (batch.labels[i] == batch.labels[j] && batch.samples[i] != batch.samples[j]) {
        farthest = std::max(farthest, distance);
      }
    }
    if (farthest >= 0) sum += farthest * farthest / 2;
    const double gap = std::max(0.0, margin - nearest);
    sum += gap * gap / 2;
  }
  return sum / static_cast<double>(2 * n);
}

// Largest difference between a gradient and central differences of the loss.
double gradient_error(Batch batch, const BatchHardOptions& options,
                      const std::vector<double>& gradient) {
  constexpr double kStep = 1e-7;
  double worst = 0;
  std::vector<double> ignored;
  for (std::size_t i = 0; i < batch.embeddings.size(); ++i) {
    const double value = batch.embeddings[i];
    batch.embeddings[i] = value + kStep;
    const double above = batch.loss(options, ignored).loss;
    batch.embeddings[i] = value - kStep;
    const double below = batch.loss(options, ignored).loss;
    batch.embeddings[i] = value;
    worst = std::max(worst, std::abs((above - below) / (2 * kStep) - gradient[i]));
  }
  return worst;
}

BatchHardOptions contrastive(double margin) { return {LossKind::contrastive, margin, 8}; }
BatchHardOptions triplet(double scale) { return {LossKind::triplet, 0.2, scale}; }

TEST(BatchHardLoss, IsTheDefinition) {
  for (const double margin : {0.05, 0.2, 2.0}) {
    const Batch batch = random_batch(6, 3, 0.1, 1);
    std::vector<double> gradient;
    EXPECT_NEAR(batch.loss(contrastive(margin), gradient).loss,
                contrastive_by_definition(batch, margin), 1e-15);
  }
}

TEST(BatchHardLoss, GradientIsTheDerivative) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Batch batch = random_batch(5, 3, 0.1, seed);
    for (const auto& options : {contrastive(0.2), contrastive(1.0), triplet(1), triplet(8)}) {
      std::vector<double> gradient;
      batch.loss(options, gradient);
      EXPECT_LT(gradient_error(batch, options, gradient), 1e-7);
      // The check must notice a wrong gradient.
      std::vector<double> wrong = gradient;
      wrong[3] += 1e-3;
      EXPECT_GT(gradient_error(batch, options, wrong), 5e-4);
    }
  }
}

TEST(BatchHardLoss, OddBatchesHaveGradientsToo) {
  // One person without a partner, one with two, one with three.
  Batch batch = random_batch(3, 3, 0.1, 7);
  batch.labels = {0, 1, 1, 2, 2, 2, 3, 3, 4};
  for (const auto& options : {contrastive(0.2), triplet(8)}) {
    std::vector<double> gradient;
    batch.loss(options, gradient);
    EXPECT_LT(gradient_error(batch, options, gradient), 1e-7);
  }
}

TEST(BatchHardLoss, OnlyStrangersPushOneAnother) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Batch batch = random_batch(5, 3, 0.1, seed);
    batch.strangers = [](int a, int b) { return (a < 2) == (b < 2) && a != 4 && b != 4; };
    for (const auto& options : {contrastive(0.2), triplet(8)}) {
      std::vector<double> gradient;
      batch.loss(options, gradient);
      EXPECT_LT(gradient_error(batch, options, gradient), 1e-7);
    }
    std::vector<double> gradient;
    EXPECT_NEAR(batch.loss(contrastive(0.5), gradient).loss, contrastive_by_definition(batch, 0.5),
                1e-15);
  }
}

TEST(BatchHardLoss, OnePersonOnlyPulls) {
  Batch batch = random_batch(1, 4, 0.1, 8);
  std::vector<double> gradient;
  const auto result = batch.loss(contrastive(0.2), gradient);
  EXPECT_NEAR(result.loss, contrastive_by_definition(batch, 0.2), 1e-15);
  EXPECT_EQ(result.mining.active_negatives, 0);
  EXPECT_LT(gradient_error(batch, contrastive(0.2), gradient), 1e-7);
}

TEST(BatchHardLoss, AtDistanceZeroTheGradientIsFinite) {
  Batch batch = random_batch(2, 2, 0.1, 9);
  std::fill(batch.embeddings.begin(), batch.embeddings.end(), 0.25);
  for (const auto& options : {contrastive(0.2), triplet(8)}) {
    std::vector<double> gradient;
    const auto result = batch.loss(options, gradient);
    EXPECT_TRUE(std::isfinite(result.loss));
    EXPECT_EQ(result.mining.spread, 0);
    for (const double value : gradient) EXPECT_EQ(value, 0);
  }
}

TEST(BatchHardLoss, TheFirstOfEquallyHardPartnersIsTaken) {
  // The anchor lies midway between two positives on a line; so only one of them is pulled.
  Batch batch;
  batch.dim = 1;
  batch.embeddings = {0.0, 0.5, -0.5};
  batch.labels = {0, 0, 0};
  batch.samples = {0, 1, 2};
  std::vector<double> gradient;
  batch.loss(contrastive(0.2), gradient);
  // anchor 0 <-> row 1 (0.5); anchors 1 and 2 <-> each other (1.0 twice); mean over 6 terms
  EXPECT_NEAR(gradient[0], -0.5 / 6, 1e-12);
  EXPECT_NEAR(gradient[1], (0.5 + 2.0) / 6, 1e-12);
  EXPECT_NEAR(gradient[2], -2.0 / 6, 1e-12);
}

TEST(BatchHardLoss, AnImageDrawnTwiceIsNotItsOwnPartner) {
  Batch batch = random_batch(2, 2, 0.1, 10);
  batch.samples = {4, 4, 5, 6};  // the first person's image twice (say, differently augmented)
  std::vector<double> gradient;
  const auto result = batch.loss(contrastive(1e-6), gradient);
  EXPECT_NEAR(result.loss, contrastive_by_definition(batch, 1e-6), 1e-15);
  for (std::size_t i = 0; i < 2 * batch.dim; ++i) EXPECT_EQ(gradient[i], 0) << i;
  EXPECT_NE(gradient[2 * batch.dim], 0);
}

TEST(BatchHardLoss, FloatAgreesWithDouble) {
  const Batch batch = random_batch(8, 4, 0.1, 11);
  std::vector<double> gradient;
  const double expected = batch.loss(contrastive(0.2), gradient).loss;
  const std::vector<float> rows(batch.embeddings.begin(), batch.embeddings.end());
  std::vector<float> single(rows.size());
  const double loss =
      batch_hard_loss<float>(rows, batch.labels, batch.samples, contrastive(0.2), single).loss;
  EXPECT_NEAR(loss, expected, 1e-7 * expected + 1e-9);
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_NEAR(single[i], gradient[i], 1e-8);
}

TEST(BatchHardLoss, StatisticsOfAKnownBatch) {
  Batch batch;
  batch.dim = 2;
  batch.embeddings = {0, 0, 3, 4, 0, 0.1, 6, 8};  // two people on the corners of lines
  batch.labels = {0, 0, 1, 1};
  batch.samples = {0, 1, 2, 3};
  std::vector<double> gradient;
  const auto mining = batch.loss(contrastive(0.2), gradient).mining;
  EXPECT_EQ(mining.active_negatives, 0.5);  // rows 0 and 2, 0.1 apart
  const double d23 = std::hypot(6, 7.9);
  EXPECT_NEAR(mining.hardest_positive, (5 + 5 + d23 + d23) / 4, 1e-9);
  const double d12 = std::hypot(3, 3.9);
  EXPECT_NEAR(mining.hardest_negative, (0.1 + d12 + 0.1 + 5) / 4, 1e-9);
  EXPECT_NEAR(mining.mean_distance, (5 + 0.1 + 10 + d12 + 5 + d23) / 6, 1e-9);
}

TEST(BatchHardLoss, RefusesWhatDoesNotFit) {
  Batch batch = random_batch(2, 2, 0.1, 12);
  std::vector<double> gradient(batch.embeddings.size());
  batch.samples.pop_back();
  EXPECT_THROW(batch_hard_loss<double>(batch.embeddings, batch.labels, batch.samples,
                                       contrastive(0.2), gradient),
               std::invalid_argument);
  try {
    contrastive(0.0).validate();
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("margin is 0"));
  }
  EXPECT_THROW(contrastive(-1).validate(), std::invalid_argument);
  EXPECT_THROW(contrastive(std::nan("")).validate(), std::invalid_argument);
  EXPECT_THROW(triplet(0).validate(), std::invalid_argument);
}

TEST(CollapseMonitor, WarnsOnceOfEachTrap) {
  MiningStatistics healthy{0.2, 0.1, 0.15, 0.8, 0.14};
  MiningStatistics pull_only{1.41, 1.4, 1.3, 0.0, 1.0};  // batch normalisation at gamma 1, beta 0
  MiningStatistics point{0, 0, 0, 1.0, 0};
  MiningStatistics finished{0.9, 0.05, 0.5, 0.0, 0.6};  // nothing left to push, but people apart
  CollapseMonitor monitor;
  for (int i = 0; i < 200; ++i) EXPECT_EQ(monitor.add(healthy), "");
  for (int i = 0; i < 200; ++i) EXPECT_EQ(monitor.add(finished), "");
  std::vector<std::string> warnings;
  for (int i = 0; i < 200; ++i) warnings.push_back(monitor.add(pull_only));
  EXPECT_EQ(std::count(warnings.begin(), warnings.end(), ""), 199);
  EXPECT_THAT(warnings[49], HasSubstr("no negative pair is within the margin"));
  for (int i = 0; i < 49; ++i) EXPECT_EQ(monitor.add(point), "");
  EXPECT_THAT(monitor.add(point), HasSubstr("collapsed"));
}

}  // namespace
}  // namespace sdmt::train
