// SPDX-License-Identifier: Apache-2.0
// Ground-truth files: what is read is sane, and scores perfectly against itself.
#include <cmath>
#include <stdexcept>

#include "memory_file.h"
#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"

using namespace sdmt;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  static fuzz::MemoryFile file;
  eval::GroundTruth gt{"S", "gt.txt", 0, false, {}};
  try {
    gt.rows = mot::read_ground_truth(file.fill(bytes, count));
  } catch (const std::invalid_argument&) {
    return 0;
  }
  std::vector<mot::ResultRow> results;
  int frame = 1;
  bool ordinary = true;  // sizes at which the overlap of a box with itself is 1
  for (const auto& row : gt.rows) {
    fuzz::require(row.frame >= frame && row.category >= 0);
    fuzz::require(std::isfinite(row.box.left) && row.box.width >= 0 && row.box.height >= 0);
    ordinary = ordinary && std::abs(row.box.left) < 1e6 && std::abs(row.box.top) < 1e6 &&
               row.box.width > 1e-3 && row.box.height > 1e-3 && row.box.width < 1e6 &&
               row.box.height < 1e6;
    frame = row.frame;
    if (row.keep) results.push_back({row.frame, row.id, row.box, 1.0, -1});
  }
  gt.num_frames = gt.rows.empty() ? 0 : gt.rows.back().frame;
  if (gt.num_frames > 100'000) return 0;  // slow, not wrong
  try {
    const auto prepared = eval::prepare_sequence(gt, results, "S.txt", eval::Benchmark::mot15,
                                                 eval::Compat::trackeval);
    const auto scores = eval::score_sequence(prepared.similarities, eval::Compat::trackeval);
    fuzz::require(!ordinary || scores.clear.clr_fn == 0);
    fuzz::require(scores.clear.clr_tp + scores.clear.clr_fn == scores.count.gt_dets);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
