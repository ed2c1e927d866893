// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/prepare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace sdmt::eval {
namespace {

using mot::GroundTruthRow;
using mot::ResultRow;
using mot::Tlwh;
using testing::ElementsAre;
using testing::HasSubstr;

GroundTruth make_gt(std::vector<GroundTruthRow> rows, int num_frames) {
  return {"S", "S/gt/gt.txt", num_frames, true, std::move(rows)};
}

GroundTruthRow person(int frame, int id, Tlwh box, int category = kPedestrian, bool keep = true) {
  return {frame, id, box, keep, category, 1.0};
}

ResultRow result(int frame, int id, Tlwh box) { return {frame, id, box, 1.0, -1}; }

std::string message_of(const GroundTruth& gt, const std::vector<ResultRow>& results,
                       Benchmark benchmark = Benchmark::mot16, Compat compat = Compat::trackeval) {
  try {
    prepare_sequence(gt, results, "S.txt", benchmark, compat);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(Prepare, ResultsOnDistractorsAreRemovedByClassAndBenchmark) {
  // One box on each class, far apart.
  std::vector<GroundTruthRow> rows;
  std::vector<ResultRow> results;
  for (int category = 1; category <= kNumCategories; ++category) {
    const Tlwh box{100.0 * category, 10, 40, 80};
    rows.push_back(person(1, category, box, category));
    results.push_back(result(1, 100 + category, box));
  }
  const auto gt = make_gt(rows, 1);
  const auto kept = [&](Benchmark benchmark) {
    return prepare_sequence(gt, results, "S.txt", benchmark, Compat::trackeval).result_labels;
  };
  EXPECT_THAT(kept(Benchmark::mot16),
              ElementsAre(101, 103, 104, 105, 106, 109, 110, 111, 113));  // not 2, 7, 8, 12
  EXPECT_EQ(kept(Benchmark::mot17), kept(Benchmark::mot16));
  EXPECT_THAT(kept(Benchmark::mot20), ElementsAre(101, 103, 104, 105, 109, 110, 111, 113));
  EXPECT_EQ(kept(Benchmark::mot15).size(), 13U);

  const auto mot16 = prepare_sequence(gt, results, "S.txt", Benchmark::mot16, Compat::trackeval);
  EXPECT_THAT(mot16.gt_labels, ElementsAre(1));
  EXPECT_EQ(mot16.removed_results, 4);
  EXPECT_EQ(mot16.results_on_uncounted[3], 1);
  EXPECT_EQ(mot16.results_on_uncounted[kPedestrian], 0);
}

TEST(Prepare, ABoxThatFitsAPedestrianBetterStays) {
  const auto gt =
      make_gt({person(1, 1, {100, 100, 40, 80}), person(1, 2, {110, 100, 40, 80}, 8)}, 1);
  const auto on_person = prepare_sequence(gt, std::vector{result(1, 5, {102, 100, 40, 80})},
                                          "S.txt", Benchmark::mot16, Compat::trackeval);
  EXPECT_THAT(on_person.result_labels, ElementsAre(5));
  const auto on_distractor = prepare_sequence(gt, std::vector{result(1, 5, {108, 100, 40, 80})},
                                              "S.txt", Benchmark::mot16, Compat::trackeval);
  EXPECT_TRUE(on_distractor.result_labels.empty());
}

TEST(Prepare, RowsMarkedZeroDoNotCount) {
  const auto gt =
      make_gt({person(1, 1, {0, 0, 9, 9}, kPedestrian, false), person(1, 2, {20, 0, 9, 9})}, 1);
  for (const auto benchmark : {Benchmark::mot15, Benchmark::mot16}) {
    const auto prepared = prepare_sequence(gt, {}, "S.txt", benchmark, Compat::trackeval);
    EXPECT_THAT(prepared.gt_labels, ElementsAre(2));
  }
}

TEST(Prepare, RenumbersIdsAndKeepsBoxes) {
  const auto gt = make_gt({person(1, 70, {0, 0, 10, 10}), person(2, 7, {0, 0, 10, 10})}, 3);
  const auto prepared =
      prepare_sequence(gt, std::vector{result(2, -1, {0, 0, 10, 5}), result(3, 4, {1, 2, 3, 4})},
                       "S.txt", Benchmark::mot16, Compat::trackeval);
  EXPECT_THAT(prepared.gt_labels, ElementsAre(7, 70));
  EXPECT_THAT(prepared.result_labels, ElementsAre(-1, 4));
  ASSERT_EQ(prepared.similarities.frames.size(), 3U);
  EXPECT_THAT(prepared.similarities.frames[0].gt_ids, ElementsAre(1));
  EXPECT_THAT(prepared.similarities.frames[1].gt_ids, ElementsAre(0));
  ASSERT_EQ(prepared.similarities.frames[1].overlaps.size(), 1U);
  EXPECT_DOUBLE_EQ(prepared.similarities.frames[1].overlaps[0].similarity, 0.5);
  EXPECT_EQ(prepared.result_boxes[2][0], (Tlwh{1, 2, 3, 4}));
}

TEST(Prepare, DuplicateIdsAreRefusedInBothModes) {
  const auto gt = make_gt({person(1, 1, {0, 0, 9, 9})}, 5);
  const std::vector twice{result(3, 8, {0, 0, 9, 9}), result(3, 8, {50, 0, 9, 9})};
  for (const auto compat : {Compat::trackeval, Compat::devkit}) {
    EXPECT_EQ(message_of(gt, twice, Benchmark::mot16, compat),
              "S.txt: frame 3, id 8: id occurs more than once in this frame");
  }
  const auto gt_twice = make_gt({person(1, 4, {0, 0, 9, 9}), person(1, 4, {50, 0, 9, 9})}, 5);
  EXPECT_THAT(message_of(gt_twice, {}),
              HasSubstr("gt.txt: frame 1, id 4: id occurs more than once"));
}

TEST(Prepare, FramesPastTheEnd) {
  const auto gt = make_gt(
      {person(1, 1, {0, 0, 9, 9}), person(4, 1, {0, 0, 9, 9}), person(6, 2, {0, 0, 9, 9}, 3)}, 8);
  const std::vector late{result(4, 8, {0, 0, 9, 9}), result(9, 8, {0, 0, 9, 9})};
  EXPECT_EQ(message_of(gt, late),
            "S.txt: frame 9, id 8: the sequence has 8 frames (seqLength in seqinfo.ini)");
  // The devkit stops at the last frame with somebody to find.
  const auto cut = prepare_sequence(gt, late, "S.txt", Benchmark::mot16, Compat::devkit);
  EXPECT_EQ(cut.similarities.frames.size(), 4U);
  EXPECT_EQ(cut.similarities.num_result_dets(), 1);

  auto without_length = make_gt({person(4, 1, {0, 0, 9, 9})}, 4);
  without_length.has_length = false;
  EXPECT_THAT(message_of(without_length, late),
              HasSubstr("has 4 frames of ground truth and no seqinfo.ini"));
  EXPECT_THAT(message_of(make_gt({person(9, 1, {0, 0, 9, 9})}, 8), {}),
              HasSubstr("gt.txt: frame 9, id 1"));
}

TEST(Prepare, AbsurdLengthsAreRefused) {
  EXPECT_THAT(message_of(make_gt({person(2'000'000'000, 1, {0, 0, 9, 9})}, 2'000'000'000), {}),
              HasSubstr("2000000000 frames, expected at most 10000000"));
}

TEST(Prepare, GroundTruthWithoutClassesIsMot15Only) {
  const auto gt = make_gt({person(1, 9, {0, 0, 9, 9}, 0)}, 1);
  EXPECT_EQ(
      message_of(gt, {}),
      "S/gt/gt.txt: frame 1, id 9: class is 0, expected 1..13: MOT16 ground truth has a class "
      "in its eighth column; without classes use MOT15");
  EXPECT_EQ(message_of(gt, {}, Benchmark::mot15), "no error");
  EXPECT_THAT(message_of(make_gt({person(1, 9, {0, 0, 9, 9}, 14)}, 1), {}),
              HasSubstr("class is 14"));
}

TEST(Prepare, ResultClassAboveOneIsRefusedByTrackEvalOnly) {
  const auto gt = make_gt({person(1, 1, {0, 0, 9, 9})}, 1);
  std::vector results{result(1, 2, {0, 0, 9, 9})};
  results[0].category = 3;
  EXPECT_EQ(message_of(gt, results), "S.txt: frame 1, id 2: class is 3, expected 1 or -1");
  EXPECT_EQ(message_of(gt, results, Benchmark::mot16, Compat::devkit), "no error");
}

TEST(Benchmark, Names) {
  EXPECT_EQ(parse_benchmark("mot17"), Benchmark::mot17);
  EXPECT_EQ(to_string(Benchmark::mot20), "MOT20");
  EXPECT_THROW(parse_benchmark("MOT18"), std::invalid_argument);
  EXPECT_EQ(parse_compat("devkit"), Compat::devkit);
  EXPECT_THROW(parse_compat("matlab"), std::invalid_argument);
  EXPECT_EQ(category_name(12), "reflection");
}

TEST(Overlaps, HandComputed) {
  const std::vector<Tlwh> gt{{0, 0, 10, 10}, {0, 0, 0, 10}};
  const std::vector<Tlwh> results{{5, 0, 10, 10}, {20, 0, 10, 10}, {0, 0, 10, 10}, {10, 0, 5, 5}};
  const auto found = overlapping_pairs(gt, results);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].result, 0);
  EXPECT_DOUBLE_EQ(found[0].similarity, 50.0 / 150.0);
  EXPECT_EQ(found[1].result, 2);
  EXPECT_DOUBLE_EQ(found[1].similarity, 1.0);
}

TEST(Overlaps, AbsurdBoxesOverlapNothing) {
  const std::vector<Tlwh> boxes{{0, 0, 1e300, 1e300}, {-1e308, 0, 1.7e308, 5}};
  EXPECT_TRUE(overlapping_pairs(boxes, boxes).empty());
}

}  // namespace
}  // namespace sdmt::eval
