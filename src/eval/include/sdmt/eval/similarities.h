// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/mot/box.h"

namespace sdmt::eval {

/// Two boxes of one frame that overlap.
struct BoxPair {
  int gt = 0;             ///< position in the frame's gt_ids
  int result = 0;         ///< position in the frame's result_ids
  double similarity = 0;  ///< intersection over union, in (0, 1]
};

/// One frame as the metrics see it: who is there, and how well the boxes agree.
struct FrameSimilarities {
  std::vector<int> gt_ids;      ///< in [0, num_gt_ids), each at most once
  std::vector<int> result_ids;  ///< in [0, num_result_ids), each at most once
  /// By gt, then result; a pair that is not listed has similarity 0.
  std::vector<BoxPair> overlaps;
};

/// All that CLEAR, Identity and HOTA need to know of a sequence.
struct SequenceSimilarities {
  std::vector<FrameSimilarities> frames;  ///< one for each frame, empty ones too
  int num_gt_ids = 0;                     ///< each id occurs in at least one frame
  int num_result_ids = 0;

  std::int64_t num_gt_dets() const;
  std::int64_t num_result_dets() const;
};

/// The pairs with intersection over union above 0, by gt, then result.
///
/// Computed over corners (right = left + width) as TrackEval does, so that a pair at a threshold
/// rounds to the same side; mot::iou differs from it in the last digits. Boxes without extent
/// overlap nothing.
std::vector<BoxPair> overlapping_pairs(std::span<const mot::Tlwh> gt,
                                       std::span<const mot::Tlwh> results);

/// A similarity s counts as reaching `threshold` when s >= threshold - kSimilaritySlack: machine
/// epsilon, TrackEval's allowance for rounding in CLEAR and HOTA (Identity makes none).
inline constexpr double kSimilaritySlack = 0x1p-52;

}  // namespace sdmt::eval
