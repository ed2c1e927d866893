// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_result.h"

namespace sdmt::tuning {

namespace {

std::vector<int> everywhere(const eval::RunGrid& grid, int setting) {
  return std::vector<int>(grid.sequences(), setting);
}

// All settings, or those that leave option `fixed` at the base's value.
std::vector<int> settings_with(const TuningPlan& plan, int fixed) {
  std::vector<int> settings;
  for (int i = 0; i < static_cast<int>(plan.settings.size()); ++i) {
    if (fixed < 0 || plan.settings[i].values[fixed] == plan.settings.front().values[fixed]) {
      settings.push_back(i);
    }
  }
  return settings;
}

ChoiceScores choice_scores(const eval::RunGrid& grid, const std::vector<int>& settings) {
  return {eval::grid_scores(grid, settings),
          eval::paired_gain(grid, settings, everywhere(grid, 0))};
}

SequenceScores sequence_scores(const eval::RunGrid& grid, int setting, int sequence) {
  SequenceScores scores;
  for (int draw = 0; draw < grid.draws(); ++draw) {
    scores.mota += grid.at(setting, sequence, draw).mota() / grid.draws();
    scores.idf1 += grid.at(setting, sequence, draw).idf1() / grid.draws();
  }
  return scores;
}

// The best setting on all sequences, and for each the best on the others.
struct Choice {
  Choice(const eval::RunGrid& grid, const std::vector<int>& allowed)
      : best(eval::best_setting(grid, allowed, "")),
        in_sample(choice_scores(grid, everywhere(grid, best))),
        left_out(eval::held_out_settings(grid, allowed)),
        held_out(choice_scores(grid, left_out)) {}

  int best;
  ChoiceScores in_sample;
  std::vector<int> left_out;
  ChoiceScores held_out;
};

}  // namespace

TuningResult tuning_result(const TuningPlan& plan, const eval::RunGrid& grid) {
  const Choice choice(grid, settings_with(plan, -1));
  const int bytetrack = grid.settings() - 1;
  TuningResult result;
  result.settings = static_cast<int>(plan.settings.size());
  result.draws = grid.draws();
  result.base = choice_scores(grid, everywhere(grid, 0));
  result.in_sample = choice.in_sample;
  result.held_out = choice.held_out;
  result.bytetrack = choice_scores(grid, everywhere(grid, bytetrack));
  result.chosen = plan.settings[choice.best].options;
  for (int i = 0; i < static_cast<int>(plan.tuned.size()); ++i) {
    const Choice without(grid, settings_with(plan, i));
    result.options.push_back(
        {plan.tuned[i], plan.settings.front().values[i], plan.settings[choice.best].values[i],
         choice.in_sample.scores.objective() - without.in_sample.scores.objective(),
         choice.held_out.scores.objective() - without.held_out.scores.objective()});
  }
  for (int i = 0; i < grid.sequences(); ++i) {
    result.sequences.push_back({grid.place(i), plan.sequences[i].detector,
                                plan.settings[choice.left_out[i]].values,
                                sequence_scores(grid, choice.left_out[i], i),
                                sequence_scores(grid, 0, i), sequence_scores(grid, bytetrack, i)});
  }
  return result;
}

}  // namespace sdmt::tuning
