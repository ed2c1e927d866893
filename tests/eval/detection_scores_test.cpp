// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/detection_scores.h"

#include <gtest/gtest.h>

namespace sdmt::eval {
namespace {

constexpr mot::Tlwh kAnna{10, 10, 20, 40}, kBen{100, 10, 20, 40}, kNobody{300, 10, 20, 40};

TEST(DetectionScores, CountWhatIsFoundAndWhatIsNot) {
  DetectionScorer scorer;
  const std::vector<mot::Tlwh> people{kAnna, kBen};
  // Two boxes on Anna: the better one finds her.
  scorer.add_frame(people, {},
                   std::vector<mot::Detection>{
                       {kAnna, 0.6}, {{11, 11, 20, 40}, 0.9}, {kNobody, 0.7}, {kBen, 0.2}});
  const auto high = scorer.scores(0.5);
  EXPECT_EQ(high.people, 2u);
  EXPECT_EQ(high.boxes, 3u);
  EXPECT_EQ(high.found, 1u);
  EXPECT_DOUBLE_EQ(high.recall, 0.5);
  EXPECT_DOUBLE_EQ(high.precision, 1.0 / 3);
  const auto all = scorer.scores(0);
  EXPECT_DOUBLE_EQ(all.recall, 1);
  EXPECT_DOUBLE_EQ(all.precision, 0.5);
  // Precision 1 up to recall 0.5, 2/4 up to 1.
  EXPECT_DOUBLE_EQ(all.average_precision, 0.75);
  EXPECT_DOUBLE_EQ(high.average_precision, 0.75);
}

TEST(DetectionScores, BoxesOnIgnoredOnesDoNotCount) {
  DetectionScorer scorer;
  scorer.add_frame(std::vector{kAnna}, std::vector{kNobody},
                   std::vector<mot::Detection>{{kNobody, 0.9}, {kAnna, 0.8}});
  EXPECT_EQ(scorer.scores(0).boxes, 1u);
  EXPECT_DOUBLE_EQ(scorer.scores(0).average_precision, 1);
}

TEST(DetectionScores, NothingIsNotANumberOfNothing) {
  DetectionScorer scorer;
  scorer.add_frame({}, {}, {});
  EXPECT_EQ(scorer.scores(0).recall, 0);
  EXPECT_EQ(scorer.scores(0).precision, 0);
  EXPECT_EQ(scorer.scores(0).average_precision, 0);
}

}  // namespace
}  // namespace sdmt::eval
