// SPDX-License-Identifier: Apache-2.0
#include "best_weights.h"

#include <cstddef>

namespace sdmt::train {

void BestWeights::keep(const std::vector<nn::NamedTensor>& state, std::int64_t after_iteration) {
  iteration = after_iteration;
  values.clear();
  for (const auto& [name, tensor] : state) values.push_back(*tensor);
}

bool BestWeights::offer(const std::vector<nn::NamedTensor>& state, std::int64_t after_iteration,
                        const std::vector<double>& its_scores) {
  if (!its_scores.empty() && !(mean_score(its_scores) > mean_score(scores))) return false;
  scores = its_scores;
  keep(state, after_iteration);
  return true;
}

void BestWeights::restore(const std::vector<nn::NamedTensor>& state) const {
  for (std::size_t i = 0; i < state.size(); ++i) *state[i].tensor = values[i];
}

double mean_score(const std::vector<double>& scores) {
  double sum = 0;
  for (const double score : scores) sum += score;
  return scores.empty() ? 0 : sum / static_cast<double>(scores.size());
}

}  // namespace sdmt::train
