// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/identity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "make_sequence.h"
#include "sdmt/nn/random.h"

namespace sdmt::eval {
namespace {

TEST(Identity, OnePersonUnderTwoIds) {
  std::vector<FrameSimilarities> frames;
  for (int t = 0; t < 10; ++t) {
    const int id = t < 6 ? 0 : 1;
    frames.push_back(make_frame({0}, {id}, {{0, id, 0.9}}));
  }
  const auto s = identity(make_sequence(frames));
  EXPECT_EQ(s.idtp, 6);
  EXPECT_EQ(s.idfn, 4);
  EXPECT_EQ(s.idfp, 4);
  EXPECT_DOUBLE_EQ(s.idf1, 0.6);
  EXPECT_DOUBLE_EQ(s.idp, 0.6);
  EXPECT_DOUBLE_EQ(s.idr, 0.6);
}

TEST(Identity, TheBestPairMayHaveToGo) {
  // Person 0 shares 5 frames with id 0 and 4 with id 1, person 1 shares 4 with id 0.
  std::vector<FrameSimilarities> frames;
  for (int t = 0; t < 5; ++t) frames.push_back(make_frame({0}, {0}, {{0, 0, 0.9}}));
  for (int t = 0; t < 4; ++t) frames.push_back(make_frame({0}, {1}, {{0, 1, 0.9}}));
  for (int t = 0; t < 4; ++t) frames.push_back(make_frame({1}, {0}, {{1, 0, 0.9}}));
  EXPECT_EQ(identity(make_sequence(frames)).idtp, 8);
}

TEST(Identity, OneHalfCountsAndLessDoesNot) {
  const auto s = identity(make_sequence(
      {make_frame({0}, {0}, {{0, 0, 0.5}}), make_frame({0}, {0}, {{0, 0, 0.4999999}})}));
  EXPECT_EQ(s.idtp, 1);
}

TEST(Identity, WithoutResultsOrGroundTruth) {
  EXPECT_EQ(identity(make_sequence({make_frame({0, 1}, {}, {})})).idfn, 2);
  EXPECT_EQ(identity(make_sequence({make_frame({}, {0, 1}, {})})).idfp, 2);
  EXPECT_EQ(identity(SequenceSimilarities{}).idf1, 0.0);
}

TEST(Identity, EqualsTheBestOfAllAssignments) {
  nn::Random random(3);
  for (int round = 0; round < 200; ++round) {
    constexpr int kIds = 5;
    int shared[kIds][kIds] = {};
    std::vector<FrameSimilarities> frames;
    for (int t = 0; t < 12; ++t) {
      std::vector<int> results(kIds);
      std::iota(results.begin(), results.end(), 0);
      random.shuffle(std::span(results));
      std::vector<IdPair> pairs;
      for (int person = 0; person < kIds; ++person) {
        const int id = results[person];
        if (random.uniform() < 0.3) continue;
        pairs.push_back({person, id, 0.9});
        ++shared[person][id];
      }
      frames.push_back(make_frame({0, 1, 2, 3, 4}, {0, 1, 2, 3, 4}, pairs));
    }
    std::vector<int> order{0, 1, 2, 3, 4};
    int best = 0;
    do {
      int total = 0;
      for (int person = 0; person < kIds; ++person) {
        total += shared[person][order[person]];
      }
      best = std::max(best, total);
    } while (std::next_permutation(order.begin(), order.end()));
    ASSERT_EQ(identity(make_sequence(frames)).idtp, best);
  }
}

}  // namespace
}  // namespace sdmt::eval
