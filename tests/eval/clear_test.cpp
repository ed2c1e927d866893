// SPDX-License-Identifier: Apache-2.0
// Small tables counted by hand.
#include "sdmt/eval/clear.h"

#include <gtest/gtest.h>

#include <cmath>

#include "make_sequence.h"

namespace sdmt::eval {
namespace {

constexpr Compat kBoth[] = {Compat::trackeval, Compat::devkit};

TEST(Clear, CountsAndRatios) {
  const auto sequence = make_sequence({
      make_frame({0, 1}, {0, 1}, {{0, 0, 0.9}, {1, 1, 0.7}}),
      make_frame({0, 1}, {0, 2}, {{0, 0, 0.8}, {1, 2, 0.6}}),  // person 1: result 1 -> 2
      make_frame({0, 1}, {0}, {{0, 0, 0.4}}),                  // too little overlap
  });
  for (const auto compat : kBoth) {
    const auto s = clear_mot(sequence, compat);
    EXPECT_EQ(s.clr_tp, 4);
    EXPECT_EQ(s.clr_fn, 2);
    EXPECT_EQ(s.clr_fp, 1);
    EXPECT_EQ(s.idsw, 1);
    EXPECT_EQ(s.clr_frames, 3);
    EXPECT_DOUBLE_EQ(s.mota, (4.0 - 1 - 1) / 6);
    EXPECT_DOUBLE_EQ(s.moda, (4.0 - 1) / 6);
    EXPECT_DOUBLE_EQ(s.motp, (0.9 + 0.7 + 0.8 + 0.6) / 4);
    EXPECT_DOUBLE_EQ(s.smota, (3.0 - 1 - 1) / 6);
    EXPECT_DOUBLE_EQ(s.clr_re, 4.0 / 6);
    EXPECT_DOUBLE_EQ(s.clr_pr, 4.0 / 5);
    EXPECT_DOUBLE_EQ(s.clr_f1, 4.0 / 5.5);
    EXPECT_DOUBLE_EQ(s.fp_per_frame, 1.0 / 3);
    EXPECT_EQ(s.pt, 2);  // two thirds of the frames each
    EXPECT_DOUBLE_EQ(s.ptr, 1.0);
    const double log_switches = compat == Compat::devkit ? std::log10(2.0) : 0.0;
    EXPECT_DOUBLE_EQ(s.motal, (4.0 - 1 - log_switches) / 6);
  }
}

TEST(Clear, DevkitForgivesAChangeAfterAnAbsence) {
  const auto sequence = make_sequence({
      make_frame({0}, {0}, {{0, 0, 0.9}}),
      make_frame({}, {0}, {}),
      make_frame({0}, {1}, {{0, 1, 0.9}}),
  });
  EXPECT_EQ(clear_mot(sequence, Compat::trackeval).idsw, 1);
  EXPECT_EQ(clear_mot(sequence, Compat::devkit).idsw, 0);
}

TEST(Clear, BothCountAChangeAfterAMiss) {
  const auto sequence = make_sequence({
      make_frame({0}, {0}, {{0, 0, 0.9}}),
      make_frame({0}, {2}, {}),
      make_frame({0}, {1}, {{0, 1, 0.9}}),
  });
  for (const auto compat : kBoth) EXPECT_EQ(clear_mot(sequence, compat).idsw, 1);
}

TEST(Clear, PairsAreKeptAgainstBetterOverlap) {
  const auto sequence = make_sequence({
      make_frame({0}, {0}, {{0, 0, 0.9}}),
      make_frame({0}, {0, 1}, {{0, 0, 0.5}, {0, 1, 0.9}}),
      make_frame({0}, {0, 1}, {{0, 0, 0.49}, {0, 1, 0.9}}),
  });
  for (const auto compat : kBoth) {
    ClearMatches matches;
    EXPECT_EQ(clear_mot(sequence, compat, &matches).idsw, 1);
    EXPECT_EQ(matches[1][0].result_id, 0);
    EXPECT_EQ(matches[2][0].result_id, 1);
    EXPECT_EQ(matches[2][0].previous_result_id, 0);
    EXPECT_TRUE(matches[2][0].idsw);
    EXPECT_FALSE(matches[1][0].idsw);
  }
}

TEST(Clear, TheFrameBeforeIsTheLastWithBothSidesInTrackEval) {
  const auto sequence = make_sequence({
      make_frame({0}, {0}, {{0, 0, 0.9}}),
      make_frame({0}, {}, {}),
      make_frame({0}, {0, 1}, {{0, 0, 0.6}, {0, 1, 0.9}}),
  });
  EXPECT_EQ(clear_mot(sequence, Compat::trackeval).idsw, 0);
  EXPECT_EQ(clear_mot(sequence, Compat::devkit).idsw, 1);
  EXPECT_EQ(clear_mot(sequence, Compat::trackeval).frag, 0);
  EXPECT_EQ(clear_mot(sequence, Compat::devkit).frag, 1);
}

TEST(Clear, DevkitMatchesMostBoxesTrackEvalMostOverlap) {
  // Two pairs of 0.9 or three of 0.5.
  const auto sequence = make_sequence({make_frame(
      {0, 1, 2}, {0, 1, 2}, {{0, 0, 0.9}, {1, 1, 0.9}, {0, 2, 0.5}, {1, 0, 0.5}, {2, 1, 0.5}})});
  EXPECT_EQ(clear_mot(sequence, Compat::trackeval).clr_tp, 2);
  EXPECT_EQ(clear_mot(sequence, Compat::devkit).clr_tp, 3);
}

TEST(Clear, TrackCountsAtTheirBounds) {
  // Ten frames; persons 0 to 3 are matched in the first 9, 8, 2 and 1 of them.
  std::vector<FrameSimilarities> frames;
  for (int t = 0; t < 10; ++t) {
    std::vector<IdPair> pairs;
    for (const auto& [person, matched] : {std::pair{0, 9}, {1, 8}, {2, 2}, {3, 1}}) {
      if (t < matched) pairs.push_back({person, person, 0.8});
    }
    frames.push_back(make_frame({0, 1, 2, 3}, {0, 1, 2, 3}, pairs));
  }
  for (const auto compat : kBoth) {
    const auto s = clear_mot(make_sequence(frames), compat);
    EXPECT_EQ(s.mt, 1);
    EXPECT_EQ(s.pt, 2);
    EXPECT_EQ(s.ml, 1);
    EXPECT_EQ(s.frag, 0);
  }
}

TEST(Clear, FragmentsAreInterruptionsOfTheMatchedSpan) {
  std::vector<FrameSimilarities> frames;
  for (const bool matched : {false, true, false, true, true, false, true, false}) {
    frames.push_back(
        make_frame({0}, {0}, matched ? std::vector<IdPair>{{0, 0, 0.7}} : std::vector<IdPair>{}));
  }
  for (const auto compat : kBoth) EXPECT_EQ(clear_mot(make_sequence(frames), compat).frag, 2);
}

TEST(Clear, ExactlyOneHalfMatches) {
  for (const auto compat : kBoth) {
    EXPECT_EQ(clear_mot(make_sequence({make_frame({0}, {0}, {{0, 0, 0.5}})}), compat).clr_tp, 1);
    EXPECT_EQ(
        clear_mot(make_sequence({make_frame({0}, {0}, {{0, 0, 0.5 - 1e-12}})}), compat).clr_tp, 0);
  }
}

TEST(Clear, WithoutResultsOrGroundTruth) {
  const auto nothing_found = make_sequence({make_frame({0, 1}, {}, {}), make_frame({0}, {}, {})});
  const auto nobody_there = make_sequence({make_frame({}, {0}, {}), make_frame({}, {0, 1}, {})});
  for (const auto compat : kBoth) {
    const auto missed = clear_mot(nothing_found, compat);
    EXPECT_EQ(missed.clr_fn, 3);
    EXPECT_EQ(missed.ml, 2);
    EXPECT_EQ(missed.mlr, 1.0);
    EXPECT_EQ(missed.mota, 0.0);
    EXPECT_EQ(clear_mot(nobody_there, compat).clr_fp, 3);
  }
  // TrackEval's early return does not count the frames.
  EXPECT_EQ(clear_mot(nothing_found, Compat::trackeval).clr_frames, 0);
  EXPECT_EQ(clear_mot(nothing_found, Compat::devkit).clr_frames, 2);
  EXPECT_EQ(clear_mot(nobody_there, Compat::trackeval).mota, 0.0);
  EXPECT_EQ(clear_mot(SequenceSimilarities{}, Compat::devkit).mota, 0.0);
}

TEST(Clear, CombinedRatiosAreThoseOfTheSums) {
  const std::vector<ClearScores> parts{
      clear_mot(make_sequence({make_frame({0}, {0}, {{0, 0, 0.6}})}), Compat::trackeval),
      clear_mot(make_sequence({make_frame({0, 1}, {}, {}), make_frame({0}, {0}, {})}),
                Compat::trackeval)};
  const auto sum = combine(parts, Compat::trackeval);
  EXPECT_EQ(sum.clr_tp, 1);
  EXPECT_EQ(sum.clr_fn, 3);
  EXPECT_EQ(sum.clr_fp, 1);
  EXPECT_DOUBLE_EQ(sum.mota, 0.0);
  EXPECT_DOUBLE_EQ(sum.motp, 0.6);
  EXPECT_DOUBLE_EQ(sum.clr_re, 0.25);
}

}  // namespace
}  // namespace sdmt::eval
