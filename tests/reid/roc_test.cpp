// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/roc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::reid {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Mann-Whitney by comparing every positive with every negative.
double area_by_comparison(const std::vector<float>& positives,
                          const std::vector<float>& negatives) {
  double wins = 0;
  for (const float p : positives) {
    for (const float n : negatives) wins += p < n ? 1.0 : p == n ? 0.5 : 0.0;
  }
  return wins / static_cast<double>(positives.size()) / static_cast<double>(negatives.size());
}

TEST(Roc, AreaIsTheShareOfRightComparisonsWithTies) {
  nn::Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<float> positives(1 + random.below(40));
    std::vector<float> negatives(1 + random.below(40));
    // Few distinct values, so that many tie.
    for (float& d : positives) d = static_cast<float>(random.below(8)) / 8.0F;
    for (float& d : negatives) d = static_cast<float>(2 + random.below(8)) / 8.0F;
    EXPECT_NEAR(Roc(positives, negatives).auc(), area_by_comparison(positives, negatives), 1e-14);
  }
}

TEST(Roc, PerfectUselessAndReversed) {
  const std::vector<float> near = {0.1F, 0.2F};
  const std::vector<float> far = {0.5F, 0.7F, 0.9F};
  const Roc perfect(near, far);
  EXPECT_DOUBLE_EQ(perfect.auc(), 1.0);
  EXPECT_DOUBLE_EQ(perfect.eer(), 0.0);
  EXPECT_DOUBLE_EQ(perfect.tpr_at_fpr(0.0), 1.0);
  EXPECT_DOUBLE_EQ(perfect.accuracy(), 1.0);
  EXPECT_NEAR(perfect.tau_a_max_accuracy(), 1 - 0.35, 1e-7);  // midway between 0.2 and 0.5
  EXPECT_NEAR(perfect.tau_a_eer(), 1 - 0.35, 1e-7);
  EXPECT_NEAR(perfect.tau_a_at_fpr(0.0), 1 - 0.35, 1e-7);
  EXPECT_DOUBLE_EQ(Roc(far, near).auc(), 0.0);
  EXPECT_DOUBLE_EQ(Roc(far, near).eer(), 1.0);
  const Roc useless(near, near);
  EXPECT_DOUBLE_EQ(useless.auc(), 0.5);
  EXPECT_DOUBLE_EQ(useless.eer(), 0.5);
  EXPECT_DOUBLE_EQ(useless.tpr_at_fpr(0.25), 0.25);
  EXPECT_DOUBLE_EQ(useless.fpr_at_tpr(0.7), 0.7);
  EXPECT_DOUBLE_EQ(perfect.fpr_at_tpr(1.0), 0.0);
}

TEST(Roc, FiguresOfACurveDrawnByHand) {
  // Points (fpr, tpr): (0,0) (0,.5) (.25,.5) (.25,1) (1,1).
  const std::vector<float> positives = {0.1F, 0.3F};
  const std::vector<float> negatives = {0.2F, 0.4F, 0.5F, 0.6F};
  const Roc roc(positives, negatives);
  EXPECT_DOUBLE_EQ(roc.auc(), 0.25 * 0.5 + 0.75 * 1.0);
  EXPECT_DOUBLE_EQ(roc.tpr_at_fpr(0.0), 0.5);
  EXPECT_DOUBLE_EQ(roc.tpr_at_fpr(0.1), 0.5);
  EXPECT_DOUBLE_EQ(roc.tpr_at_fpr(0.25), 1.0);
  EXPECT_DOUBLE_EQ(roc.fpr_at_tpr(0.0), 0.0);
  EXPECT_DOUBLE_EQ(roc.fpr_at_tpr(0.5), 0.0);
  EXPECT_DOUBLE_EQ(roc.fpr_at_tpr(0.75), 0.25);
  EXPECT_DOUBLE_EQ(roc.eer(), 0.25);  // on the vertical at 0.25, where tpr = 0.75
  EXPECT_DOUBLE_EQ(roc.accuracy(), (1.0 + 0.75) / 2);
  EXPECT_NEAR(roc.tau_a_max_accuracy(), 1 - 0.35, 1e-7);
  EXPECT_NEAR(roc.tau_a_at_fpr(0.1), 1 - 0.15, 1e-7);
  EXPECT_NEAR(roc.tau_a_at_fpr(1.0), 1 - 0.6, 1e-7);
  EXPECT_DOUBLE_EQ(roc.at(0.05).tpr, 0.0);
  EXPECT_DOUBLE_EQ(roc.at(0.35).tpr, 1.0);
  EXPECT_DOUBLE_EQ(roc.at(0.35).fpr, 0.25);
  EXPECT_DOUBLE_EQ(roc.at(2.0).fpr, 1.0);
  const auto points = roc.points();
  ASSERT_EQ(points.size(), 7U);
  EXPECT_EQ(points.front().tpr, 0.0);
  EXPECT_EQ(points.front().fpr, 0.0);
  EXPECT_LT(points.front().threshold, 0.1);
  EXPECT_EQ(points.back().tpr, 1.0);
  EXPECT_EQ(points.back().fpr, 1.0);
}

TEST(Roc, HistogramsCrossWhereTwoEqualBellsMeet) {
  nn::Random random(3);
  std::vector<float> positives(200000);
  std::vector<float> negatives(400000);  // twice as many count the same
  for (float& d : positives) d = static_cast<float>(std::abs(0.5 + 0.1 * random.normal()));
  for (float& d : negatives) d = static_cast<float>(std::abs(0.9 + 0.1 * random.normal()));
  const Roc roc(positives, negatives);
  EXPECT_NEAR(roc.tau_a_histogram_crossing(), 1 - 0.7, 0.01);
  EXPECT_NEAR(roc.tau_a_eer(), 1 - 0.7, 0.01);
  EXPECT_NEAR(roc.eer(), 0.02275, 0.001);   // two standard deviations
  EXPECT_NEAR(roc.auc(), 0.99766, 0.0005);  // normal distribution at 0.4 / (0.1 sqrt 2)
}

TEST(Roc, CountsGiveTheSameCurveAsDistances) {
  const std::vector<float> positives = {0.25F, 0.25F, 0.5F};
  const std::vector<float> negatives = {0.5F, 0.5F, 0.75F};
  const Roc a(positives, negatives);
  const Roc b({{0.25, 2, 0}, {0.3, 0, 0}, {0.5, 1, 2}, {0.75, 0, 1}});
  EXPECT_DOUBLE_EQ(a.auc(), b.auc());
  EXPECT_DOUBLE_EQ(a.eer(), b.eer());
  EXPECT_DOUBLE_EQ(a.tau_a_max_accuracy(), b.tau_a_max_accuracy());
  EXPECT_EQ(b.counts().size(), 3U);  // the empty row is gone
}

TEST(Roc, HistogramSumsToOneForEachClass) {
  const std::vector<float> positives = {0.0F, 0.1F, 0.2F};
  const std::vector<float> negatives = {0.95F, 1.0F};
  const auto h = distance_histogram(Roc(positives, negatives), 10);
  ASSERT_EQ(h.positives.size(), 10U);
  EXPECT_NEAR(h.bin_width, 0.1, 1e-7);
  EXPECT_NEAR(h.positives[0], 1.0 / 3, 1e-12);
  EXPECT_NEAR(h.negatives[9], 1.0, 1e-12);  // the largest distance belongs to the last bin
}

TEST(Roc, RefusesWhatHasNoCurve) {
  const std::vector<float> some = {0.5F};
  const std::vector<float> none;
  const std::vector<float> nan = {std::numeric_limits<float>::quiet_NaN()};
  EXPECT_THAT([&] { Roc(none, some); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no positive pair")));
  EXPECT_THAT([&] { Roc(some, none); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no negative pair")));
  EXPECT_THAT([&] { Roc(some, nan); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("not finite")));
  EXPECT_THAT(
      [&] {
        Roc({{0.5, 1, 0}, {0.4, 0, 1}});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("ascend")));
  EXPECT_THAT([&] { Roc(some, some).tpr_at_fpr(1.5); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("fpr is 1.5")));
  EXPECT_THAT([&] { Roc(some, some).fpr_at_tpr(-1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("tpr is -1")));
  EXPECT_THAT([&] { distance_histogram(Roc(some, some), 0); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("bins is 0")));
}

}  // namespace
}  // namespace sdmt::reid
