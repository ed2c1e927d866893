// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>
#include <string>
#include <tuple>

#include "sdmt/eval/held_out.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// Places in a RunGrid.
struct TuningRun {
  int setting = 0, sequence = 0, draw = 0;

  bool operator<(const TuningRun& other) const {
    return std::tie(setting, sequence, draw) < std::tie(other.setting, other.sequence, other.draw);
  }
};

/// The file of runs that are done, a line each; all threads may add to it.
class TuningState {
 public:
  /// Takes the runs that an older file holds into `grid`; a line that a killed run left unfinished
  /// is passed over. An empty path keeps nothing. Throws std::invalid_argument for the state of
  /// another search.
  TuningState(const std::filesystem::path& path, const TuningPlan& plan, eval::RunGrid& grid);

  bool knows(const TuningRun& run) const { return known_.contains(run); }
  /// Throws std::runtime_error when it cannot be written.
  void add(const TuningRun& run, const eval::RunCounts& counts);

 private:
  void read(const std::string& name, eval::RunGrid& grid);
  void check() const;

  std::filesystem::path path_;
  std::set<TuningRun> known_;
  std::ofstream file_;
  std::mutex mutex_;
};

}  // namespace sdmt::tuning
