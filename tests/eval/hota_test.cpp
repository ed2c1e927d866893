// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/hota.h"

#include <gtest/gtest.h>

#include <cmath>

#include "make_sequence.h"

namespace sdmt::eval {
namespace {

TEST(Hota, OnePersonInTwoHalves) {
  // 0.6 reaches the thresholds 0.05 ... 0.60, twelve of nineteen.
  std::vector<FrameSimilarities> frames;
  for (int t = 0; t < 4; ++t) frames.push_back(make_frame({0}, {t / 2}, {{0, t / 2, 0.6}}));
  const auto s = hota(make_sequence(frames));
  for (std::size_t a = 0; a < kNumAlphas; ++a) {
    const bool reached = a < 12;
    EXPECT_EQ(s.hota_tp[a], reached ? 4 : 0) << a;
    EXPECT_EQ(s.hota_fn[a], reached ? 0 : 4) << a;
    EXPECT_EQ(s.hota_fp[a], reached ? 0 : 4) << a;
    EXPECT_DOUBLE_EQ(s.deta[a], reached ? 1.0 : 0.0);
    // 2 boxes together of 4 + 2 - 2.
    EXPECT_DOUBLE_EQ(s.assa[a], reached ? 0.5 : 0.0);
    EXPECT_DOUBLE_EQ(s.assre[a], reached ? 0.5 : 0.0);
    EXPECT_DOUBLE_EQ(s.asspr[a], reached ? 1.0 : 0.0);
    EXPECT_DOUBLE_EQ(s.hota[a], reached ? std::sqrt(0.5) : 0.0);
    EXPECT_DOUBLE_EQ(s.loca[a], reached ? 0.6 : 1.0);
  }
  EXPECT_DOUBLE_EQ(mean(s.hota), 12 * std::sqrt(0.5) / 19);
  EXPECT_DOUBLE_EQ(s.hotaloca_0, std::sqrt(0.5) * 0.6);
}

TEST(Hota, MatchesByAgreementOverTheWholeSequence) {
  // In the last frame result 1 overlaps the person more, but result 0 followed them all along.
  std::vector<FrameSimilarities> frames(9, make_frame({0}, {0}, {{0, 0, 0.8}}));
  frames.push_back(make_frame({0}, {0, 1}, {{0, 0, 0.6}, {0, 1, 0.9}}));
  const auto s = hota(make_sequence(frames));
  EXPECT_EQ(s.hota_tp[0], 10);
  EXPECT_EQ(s.hota_fp[0], 1);
  EXPECT_DOUBLE_EQ(s.assa[0], 1.0);
  EXPECT_EQ(s.hota_tp[13], 9);  // 0.70: the last match is too loose
}

TEST(Hota, WithoutResultsOrGroundTruth) {
  const auto missed = hota(make_sequence({make_frame({0, 1}, {}, {})}));
  EXPECT_EQ(missed.hota_fn[5], 2);
  EXPECT_EQ(missed.loca[5], 1.0);
  EXPECT_EQ(mean(missed.hota), 0.0);
  const auto nobody = hota(make_sequence({make_frame({}, {0}, {})}));
  EXPECT_EQ(nobody.hota_fp[18], 1);
  EXPECT_EQ(nobody.loca_0, 1.0);
}

TEST(Hota, CombinedAssociationIsWeightedByMatches) {
  // AssA 0.5 over 4 matches and 1 over 2 matches.
  std::vector<FrameSimilarities> halves;
  for (int t = 0; t < 4; ++t) halves.push_back(make_frame({0}, {t / 2}, {{0, t / 2, 0.9}}));
  const std::vector<FrameSimilarities> whole(2, make_frame({0}, {0}, {{0, 0, 0.7}}));
  const std::vector<HotaScores> parts{hota(make_sequence(halves)), hota(make_sequence(whole))};
  const auto s = combine(parts);
  EXPECT_DOUBLE_EQ(s.assa[0], (0.5 * 4 + 1.0 * 2) / 6);
  EXPECT_DOUBLE_EQ(s.loca[0], (0.9 * 4 + 0.7 * 2) / 6);
  EXPECT_DOUBLE_EQ(s.deta[0], 1.0);
  EXPECT_DOUBLE_EQ(s.hota_0, std::sqrt(4.0 / 6));
}

TEST(Hota, AlphasAreThoseOfNumpyArange) {
  const auto alphas = hota_alphas();
  EXPECT_DOUBLE_EQ(alphas.front(), 0.05);
  EXPECT_DOUBLE_EQ(alphas.back(), 0.95);
}

}  // namespace
}  // namespace sdmt::eval
