// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "sdmt/eval/prepare.h"
#include "sdmt/eval/scores.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tools {

/// One scored sequence with all that a report about it needs.
struct SequenceEvaluation {
  std::filesystem::path folder;
  eval::PreparedSequence prepared;
  eval::Scores scores;
  eval::ClearMatches matches;
  /// Identity switches as each evaluator counts them; scores.clear.idsw is one of the two.
  std::int64_t idsw_trackeval = 0, idsw_devkit = 0;
};

/// Several sequences scored as one benchmark.
struct Evaluation {
  eval::Benchmark benchmark = eval::Benchmark::mot16;
  eval::Compat compat = eval::Compat::trackeval;
  std::vector<SequenceEvaluation> sequences;
  eval::Scores combined;
  std::int64_t idsw_trackeval = 0, idsw_devkit = 0;  ///< of all sequences
};

/// Scores `results` of one sequence. Throws as eval::prepare_sequence().
SequenceEvaluation evaluate_sequence(const std::filesystem::path& folder,
                                     const eval::GroundTruth& gt,
                                     std::span<const mot::ResultRow> results,
                                     const std::string& result_name, eval::Benchmark benchmark,
                                     eval::Compat compat);

/// Fills `combined` and the sums from the sequences.
void combine_sequences(Evaluation& evaluation);

/// {"benchmark", "compat", "alphas", "sequences": {NAME: FIELDS}, "combined": FIELDS}: FIELDS are
/// TrackEval's names with fractions, "per_alpha" arrays, and both counts of identity switches.
nlohmann::ordered_json to_json(const Evaluation& evaluation);

/// A row a sequence and one for all, a column a score.
std::string to_csv(const Evaluation& evaluation);

/// The table for the terminal, ratios in per cent, and remarks about what the rules removed or
/// counted against the results.
std::string to_text(const Evaluation& evaluation);

}  // namespace sdmt::tools
