// SPDX-License-Identifier: Apache-2.0
// Published figures on real annotations; skipped where the data is not there.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <ostream>

#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"

namespace sdmt::eval {
namespace {

namespace fs = std::filesystem;

const fs::path kData = SDMT_DATA_DIR;

struct Published {
  const char* sequence;
  double idf1, mota;  // per cent, one decimal
  int fp, fn, idsw;
};

// Names the test.
std::ostream& operator<<(std::ostream& out, const Published& published) {
  return out << published.sequence;
}

class GoldenTud : public testing::TestWithParam<Published> {};

// The devkit's scores of py-motmetrics' test files, which are CRLF and have confidence -1.
TEST_P(GoldenTud, DevkitScores) {
  const auto folder = kData / "golden" / "tud" / GetParam().sequence;
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto gt = read_sequence_ground_truth(folder);
  const auto results = mot::read_results(folder / "test.txt");
  for (const auto compat : {Compat::trackeval, Compat::devkit}) {
    const auto prepared = prepare_sequence(gt, results, "test.txt", Benchmark::mot15, compat);
    const auto scores = score_sequence(prepared.similarities, compat);
    EXPECT_DOUBLE_EQ(std::round(scores.identity.idf1 * 1000) / 10, GetParam().idf1);
    EXPECT_DOUBLE_EQ(std::round(scores.clear.mota * 1000) / 10, GetParam().mota);
    EXPECT_EQ(scores.clear.clr_fp, GetParam().fp);
    EXPECT_EQ(scores.clear.clr_fn, GetParam().fn);
    EXPECT_EQ(scores.clear.idsw, GetParam().idsw);
  }
}

INSTANTIATE_TEST_SUITE_P(All, GoldenTud,
                         testing::Values(Published{"TUD-Campus", 55.8, 52.6, 13, 150, 7},
                                         Published{"TUD-Stadtmitte", 64.5, 56.4, 45, 452, 7}));

std::vector<mot::ResultRow> as_results(const GroundTruth& gt, bool pedestrians_only) {
  std::vector<mot::ResultRow> results;
  for (const auto& row : gt.rows) {
    if (pedestrians_only && !(row.keep && row.category == kPedestrian)) continue;
    results.push_back({row.frame, row.id, row.box, 1.0, -1});
  }
  return results;
}

TEST(Mot16, GroundTruthAsResultsIsPerfect) {
  const auto root = kData / "mot16";
  if (!fs::exists(root)) GTEST_SKIP() << root << " is not there";
  std::vector<Scores> all;
  for (const auto& folder : find_sequences(root)) {
    const auto gt = read_sequence_ground_truth(folder);
    const auto prepared =
        prepare_sequence(gt, as_results(gt, true), "gt", Benchmark::mot16, Compat::trackeval);
    all.push_back(score_sequence(prepared.similarities, Compat::trackeval));
  }
  const auto sum = combine(all, Compat::trackeval);
  EXPECT_EQ(sum.count.frames, 5316);
  EXPECT_EQ(sum.count.gt_dets, 110407);
  EXPECT_EQ(sum.count.gt_ids, 517);
  EXPECT_EQ(sum.clear.mota, 1.0);
  EXPECT_EQ(sum.identity.idf1, 1.0);
  EXPECT_EQ(mean(sum.hota.hota), 1.0);
}

TEST(Mot16, AllRowsAsResultsAreNot) {
  const auto folder = kData / "mot16" / "MOT16-04";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto gt = read_sequence_ground_truth(folder);
  const auto prepared =
      prepare_sequence(gt, as_results(gt, false), "gt", Benchmark::mot16, Compat::trackeval);
  EXPECT_LT(score_sequence(prepared.similarities, Compat::trackeval).clear.mota, 0.0);
  EXPECT_GT(prepared.results_on_uncounted[4], 0);   // bicycles
  EXPECT_GT(prepared.results_on_uncounted[11], 0);  // full occluders
}

}  // namespace
}  // namespace sdmt::eval
