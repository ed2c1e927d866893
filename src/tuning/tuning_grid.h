// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sdmt/eval/held_out.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// Where the counts of all runs go: a row for each setting, and the last one for ByteTrack. Throws
/// as eval::RunGrid.
inline eval::RunGrid empty_grid(const TuningPlan& plan) {
  std::vector<std::string> places;
  for (const TuningSequence& input : plan.sequences) places.push_back(input.gt.name);
  return {std::move(places), static_cast<int>(plan.settings.size()) + 1, plan.draws};
}

}  // namespace sdmt::tuning
