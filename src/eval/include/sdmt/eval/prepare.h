// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdmt/eval/benchmark.h"
#include "sdmt/eval/ground_truth.h"
#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

/// A sequence ready to be counted: what its benchmark does not count is gone, ids are renumbered.
struct PreparedSequence {
  std::string name;
  SequenceSimilarities similarities;
  std::vector<int> gt_labels;      ///< [num_gt_ids] ids as in the file, ascending
  std::vector<int> result_labels;  ///< [num_result_ids]
  /// Boxes behind similarities.frames[t].gt_ids and .result_ids, in the same order.
  std::vector<std::vector<mot::Tlwh>> gt_boxes, result_boxes;

  /// Result boxes deleted because they follow a distractor.
  std::int64_t removed_results = 0;
  /// [category] Result boxes kept that fit a ground-truth box which does not count (a car, an
  /// occluder, a person marked 0) better than any other: false positives by the rules. Index 0 is
  /// not used.
  std::array<std::int64_t, kNumCategories + 1> results_on_uncounted{};
};

/// Applies the benchmark's rules, per frame:
///  1. MOT16, 17, 20: all ground-truth boxes, of every class and with the keep flag 0 too, are
///     assigned to result boxes at IoU >= 0.5 so that the total IoU is greatest; result boxes
///     assigned to a person on a vehicle, static person, distractor or reflection (MOT20: also a
///     non-motorised vehicle) are deleted. A box that fits a pedestrian better is kept.
///  2. Ground truth that counts: keep flag not 0 and, from MOT16 on, class pedestrian.
///
/// `results` are sorted by frame (mot::read_results), `result_name` names them in messages.
/// Compat::devkit drops results after the last frame with ground truth that counts and ignores
/// their class column; Compat::trackeval refuses both frames past the end and classes above 1.
/// Throws std::invalid_argument, naming file, frame and id, also for an id that occurs twice in a
/// frame, ground truth past the end, and a class outside 1..13 from MOT16 on.
PreparedSequence prepare_sequence(const GroundTruth& gt, std::span<const mot::ResultRow> results,
                                  const std::string& result_name, Benchmark benchmark,
                                  Compat compat);

}  // namespace sdmt::eval
