// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/auc_bootstrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <stdexcept>

#include "reid/reid_fixture.h"
#include "sdmt/nn/random.h"
#include "sdmt/reid/pair_curve.h"
#include "sdmt/reid/roc.h"

namespace sdmt::reid {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(AucBootstrap, AgreesWithAnIndependentBootstrap) {
  const auto fixture = read_reid_fixture();
  const auto curve = pair_curve(fixture_images(fixture));
  BootstrapOptions options;
  options.draws = 4000;
  const auto interval = bootstrap_auc(curve.pairs, curve.identities, curve.backgrounds, options);
  // Two bootstraps of 4,000 draws with other random numbers: quantiles within sampling error.
  EXPECT_NEAR(interval.low, fixture["auc_interval"][0].get<double>(), 0.006);
  EXPECT_NEAR(interval.high, fixture["auc_interval"][1].get<double>(), 0.003);
}

std::vector<ClusterPair> random_pairs(int clusters, int count) {
  nn::Random random(5);
  std::vector<ClusterPair> pairs;
  for (int i = 0; i < count; ++i) {
    const auto a = static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(clusters)));
    const auto b =
        i % 3 == 0 ? a
                   : static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(clusters)));
    const double d = (a == b ? 0.4 : 0.6) + 0.2 * random.normal();
    pairs.push_back({static_cast<float>(std::max(0.0, d)), a, b});
  }
  return pairs;
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  return values[below] + (at - static_cast<double>(below)) *
                             (values[std::min(below + 1, values.size() - 1)] - values[below]);
}

// Every drawn pair written out as often as it was drawn, and the curve of all of them.
TEST(AucBootstrap, IntervalsOfRatesAndThresholdAgreeWithCurvesOfTheDrawnPairs) {
  constexpr int kClusters = 12, kDraws = 60;
  const auto pairs = random_pairs(kClusters, 600);
  const OperatingPoints points{0.45, 0.1};
  std::vector<double> auc, tpr, fpr, tau_a;
  for (int draw = 0; draw < kDraws; ++draw) {
    nn::Random random(1, static_cast<std::uint64_t>(draw));
    std::vector<int> drawn(kClusters, 0);
    for (int i = 0; i < kClusters; ++i) ++drawn[random.below(kClusters)];
    std::vector<float> positives, negatives;
    for (const ClusterPair& pair : pairs) {
      const bool same = pair.first == pair.second;
      const int times = same ? drawn[static_cast<std::size_t>(pair.first)]
                             : drawn[static_cast<std::size_t>(pair.first)] *
                                   drawn[static_cast<std::size_t>(pair.second)];
      auto& class_of = same ? positives : negatives;
      class_of.insert(class_of.end(), static_cast<std::size_t>(times), pair.distance);
    }
    const Roc roc(positives, negatives);
    auc.push_back(roc.auc());
    tpr.push_back(roc.at(1 - points.tau_a).tpr);
    fpr.push_back(roc.at(1 - points.tau_a).fpr);
    tau_a.push_back(roc.tau_a_at_fpr(points.target_fpr));
  }
  BootstrapOptions options;
  options.draws = kDraws;
  const auto intervals = bootstrap_curve(pairs, kClusters, 0, points, options);
  const auto expect = [](const Interval& interval, const std::vector<double>& values) {
    EXPECT_NEAR(interval.low, percentile(values, 0.025), 1e-9);
    EXPECT_NEAR(interval.high, percentile(values, 0.975), 1e-9);
  };
  expect(intervals.auc, auc);
  expect(intervals.tpr, tpr);
  expect(intervals.fpr, fpr);
  expect(intervals.tau_a, tau_a);
  EXPECT_THAT(([&] {
                bootstrap_curve(pairs, kClusters, 0, {0.5, 1.5}, options);
              }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("target_fpr")));
}

TEST(AucBootstrap, DependsOnSeedButNotOnOrderOrThreads) {
  auto pairs = random_pairs(20, 3000);
  const auto first = bootstrap_auc(pairs, 20, 0);
  nn::Random random(9);
  random.shuffle(std::span<ClusterPair>(pairs));
  const int threads = omp_get_max_threads();
  omp_set_num_threads(3);
  const auto again = bootstrap_auc(pairs, 20, 0);
  omp_set_num_threads(threads);
  EXPECT_EQ(first.low, again.low);
  EXPECT_EQ(first.high, again.high);
  BootstrapOptions other;
  other.seed = 2;
  EXPECT_NE(first.low, bootstrap_auc(pairs, 20, 0, other).low);
}

TEST(AucBootstrap, IntervalNarrowsWithConfidenceAndIdentities) {
  BootstrapOptions half;
  half.confidence = 0.5;
  const auto few = random_pairs(10, 20000);
  const auto wide = bootstrap_auc(few, 10, 0);
  const auto narrow = bootstrap_auc(few, 10, 0, half);
  EXPECT_LT(wide.low, narrow.low);
  EXPECT_GT(wide.high, narrow.high);
}

TEST(AucBootstrap, BackgroundIsDrawnAmongItself) {
  // The only identity is in every draw: its positives stay, whatever background is drawn.
  const std::vector<ClusterPair> pairs = {{0.1F, 0, 0}, {0.5F, 0, 1}, {0.05F, 0, 2}};
  const auto interval = bootstrap_auc(pairs, 1, 2);
  EXPECT_DOUBLE_EQ(interval.low, 0.0);
  EXPECT_DOUBLE_EQ(interval.high, 1.0);
}

TEST(AucBootstrap, RefusesBadInput) {
  EXPECT_THAT(
      [] {
        bootstrap_auc({{0.1F, 0, 3}}, 2, 1);
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("clusters 0 and 3")));
  EXPECT_THAT(
      [] {
        bootstrap_auc({{0.1F, 0, 0}}, 1, 0);
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("no draw has both")));
  BootstrapOptions options;
  options.draws = 1;
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("draws is 1")));
  options = {};
  options.confidence = 1.0;
  EXPECT_THAT([&] { options.validate(); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("confidence is 1")));
}

}  // namespace
}  // namespace sdmt::reid
