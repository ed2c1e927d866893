// SPDX-License-Identifier: Apache-2.0
// Result files: what is read is sane, survives writing and reading again, and can be scored.
#include <cmath>
#include <stdexcept>

#include "memory_file.h"
#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"

using namespace sdmt;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  static fuzz::MemoryFile file;
  const bool devkit = count > 0 && bytes[0] % 2 != 0;
  std::vector<mot::ResultRow> rows;
  try {
    rows = mot::read_results(file.fill(bytes, count),
                             devkit ? mot::RowsBeforeFrame1::drop : mot::RowsBeforeFrame1::refuse);
  } catch (const std::invalid_argument&) {
    return 0;
  }
  std::string text;
  int frame = 1;
  for (const auto& row : rows) {
    fuzz::require(row.frame >= frame && std::isfinite(row.box.left) && std::isfinite(row.box.top));
    fuzz::require(row.box.width >= 0 && row.box.height >= 0 && std::isfinite(row.confidence));
    frame = row.frame;
    text += mot::format_result(row);
  }
  const auto* again = reinterpret_cast<const std::uint8_t*>(text.data());
  fuzz::require(mot::read_results(file.fill(again, text.size())).size() == rows.size());

  eval::GroundTruth gt{"S", "gt.txt", 8, true, {}};
  for (int t = 1; t <= 8; ++t)
    gt.rows.push_back({t, 1, {10, 10, 40, 80}, true, t % 4 ? 1 : 8, 1.0});
  const auto compat = devkit ? eval::Compat::devkit : eval::Compat::trackeval;
  try {
    const auto prepared = eval::prepare_sequence(gt, rows, "S.txt", eval::Benchmark::mot16, compat);
    const auto scores = eval::score_sequence(prepared.similarities, compat);
    fuzz::require(scores.clear.clr_tp + scores.clear.clr_fn == scores.count.gt_dets);
    fuzz::require(scores.identity.idtp + scores.identity.idfp == scores.count.dets);
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
