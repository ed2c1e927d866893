// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "sdmt/eval/clear.h"
#include "sdmt/eval/hota.h"
#include "sdmt/eval/identity.h"

namespace sdmt::eval {

/// What was counted, after the benchmark's rules were applied.
struct CountScores {
  std::int64_t dets = 0, gt_dets = 0;  ///< boxes
  std::int64_t ids = 0, gt_ids = 0;    ///< tracks
  std::int64_t frames = 0;
};

/// All scores of a sequence, or of several together.
struct Scores {
  ClearScores clear;
  IdentityScores identity;
  HotaScores hota;
  CountScores count;
};

/// Scores one sequence; `matches` as in clear_mot().
Scores score_sequence(const SequenceSimilarities& sequence, Compat compat,
                      ClearMatches* matches = nullptr);

/// Scores of several sequences taken as one benchmark.
Scores combine(std::span<const Scores> sequences, Compat compat);

/// A score under TrackEval's name ("MOTA", "IDSW", "HOTA(0)", ...).
struct ScoreField {
  std::string_view name;
  std::variant<std::int64_t, double> value;
};
/// Every single figure, in TrackEval's order; those of HOTA are means over the thresholds.
std::vector<ScoreField> score_fields(const Scores& scores);

/// A score at each of hota_alphas(), under TrackEval's name ("HOTA", "HOTA_TP", ...).
struct AlphaField {
  std::string_view name;
  std::variant<const AlphaCounts*, const AlphaScores*> values;  ///< point into the scores given
};
std::vector<AlphaField> alpha_fields(const Scores& scores);

}  // namespace sdmt::eval
