// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "sdmt/eval/held_out.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// Tracks and scores everything: settings of the grid are the plan's, and one more for ByteTrack,
/// smoothed and filled as the base. The same counts for any number of threads and interruptions.
///
/// Runs that the file `state` (empty: none) holds already are taken from there, the others are
/// added to it as they end. All threads call `progress`, with the runs done so far, and then
/// `stop`, one thread at a time; either may throw, which ends the work as soon as the runs that
/// others are at are done. Nothing when `stop` said so.
///
/// Throws std::invalid_argument for a state of another search, std::runtime_error for one that
/// cannot be written.
std::optional<eval::RunGrid> run_tuning(const TuningPlan& plan, const std::filesystem::path& state,
                                        const std::function<void(std::int64_t runs)>& progress,
                                        const std::function<bool()>& stop);

}  // namespace sdmt::tuning
