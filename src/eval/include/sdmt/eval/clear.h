// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/eval/benchmark.h"
#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

/// CLEAR MOT (Bernardin and Stiefelhagen 2008) with the track counts of Wu and Nevatia (2006), at
/// similarity 0.5. Names and meaning as TrackEval's; ratios are fractions, not per cent.
struct ClearScores {
  std::int64_t clr_tp = 0, clr_fn = 0, clr_fp = 0;  ///< matched, missed, false boxes
  std::int64_t idsw = 0;                            ///< identity switches
  std::int64_t mt = 0, pt = 0, ml = 0;  ///< ground-truth tracks matched in > 80 %, the rest, < 20 %
  std::int64_t frag = 0;                ///< interruptions of matched ground-truth tracks
  std::int64_t clr_frames = 0;
  double motp_sum = 0;  ///< similarity summed over matched boxes

  double mota = 0;   ///< (clr_tp - clr_fp - idsw) / ground-truth boxes; can be negative
  double motp = 0;   ///< mean similarity of matched boxes
  double moda = 0;   ///< mota without the switches
  double motal = 0;  ///< mota with log10 of the switches
  double smota = 0;  ///< mota with each match weighted by its similarity
  double clr_re = 0, clr_pr = 0, clr_f1 = 0;
  double mtr = 0, ptr = 0, mlr = 0;
  double fp_per_frame = 0;
};

/// A ground-truth box and a result box held to be the same person in one frame.
struct ClearMatch {
  int gt_id = 0;
  int result_id = 0;
  double similarity = 0;
  int previous_result_id = -1;  ///< the result id of this person's last match before; -1: none
  bool idsw = false;            ///< counted as an identity switch
};

/// The matches behind the counts, frame by frame.
using ClearMatches = std::vector<std::vector<ClearMatch>>;

/// Scores one sequence. `matches`, if given, receives the matches of every frame, by gt position.
///
/// Compat::trackeval: one assignment a frame, which prefers pairs of the last frame that had both
/// ground truth and results, then similarity; a switch is any change of result id since the last
/// match, however long ago. Without results or without ground truth TrackEval returns early, with
/// every ratio but mlr at 0; so does this.
///
/// Compat::devkit: pairs of the very frame before are kept as long as they overlap by half; the
/// rest is assigned to match most boxes, then best overlap; a switch counts only when the person
/// was in the ground truth of the frame before; motal takes log10(idsw + 1).
ClearScores clear_mot(const SequenceSimilarities& sequence, Compat compat,
                      ClearMatches* matches = nullptr);

/// Adds up the counts of several sequences and takes the ratios of the sums.
ClearScores combine(std::span<const ClearScores> sequences, Compat compat);

}  // namespace sdmt::eval
