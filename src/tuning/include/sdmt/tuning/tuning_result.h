// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sdmt/eval/held_out.h"
#include "sdmt/track/tracker_options.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// What a choice of settings reaches, and how much more than the base. Fractions.
struct ChoiceScores {
  eval::GridScores scores;
  eval::PairedGain gain;
};

/// What trying an option brings: the sum of MOTA and IDF1 (fractions) less what is reached by
/// settings that leave it at the base's value.
struct OptionWorth {
  std::string option;
  std::string base;    ///< its value there
  std::string chosen;  ///< the value chosen on all sequences
  double in_sample = 0;
  double held_out = 0;
};

/// Means over the draws, fractions.
struct SequenceScores {
  double mota = 0, idf1 = 0;
};

/// A sequence that was left out.
struct HeldOutSequence {
  std::string sequence;
  std::string detections;           ///< the name of the file in det/
  std::vector<std::string> chosen;  ///< values chosen on the others, as TuningResult::options
  SequenceScores held_out;          ///< with these
  SequenceScores base, bytetrack;
};

/// What was found, from counts alone.
struct TuningResult {
  int settings = 0, draws = 0;
  ChoiceScores base;
  ChoiceScores in_sample;  ///< the setting that is best on all sequences
  ChoiceScores held_out;   ///< for each sequence the one that is best on the others
  ChoiceScores bytetrack;  ///< smoothed and filled as the base
  std::vector<OptionWorth> options;
  std::vector<HeldOutSequence> sequences;
  track::TrackerOptions chosen;  ///< those of in_sample
};

/// Chooses, by leaving each place out. `grid`: of run_tuning() with that plan.
TuningResult tuning_result(const TuningPlan& plan, const eval::RunGrid& grid);

}  // namespace sdmt::tuning
