// SPDX-License-Identifier: Apache-2.0
#include "tuning_state.h"

#include <sstream>
#include <stdexcept>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/track/tracker_option_table.h"

namespace sdmt::tuning {

namespace {

// All that decides about the counts, in one line: a state of another search cannot be gone on with.
std::string search_name(const TuningPlan& plan) {
  const auto text = [](double value) { return io::number_text(value); };
  std::ostringstream name;
  name << "sdmt tune 1 draws " << plan.draws << " drop " << text(plan.drop) << " seed "
       << plan.seed;
  if (plan.tau_a) name << " tau_a " << text(*plan.tau_a);
  for (const TuningSequence& input : plan.sequences) {
    name << " | " << input.gt.name << " " << input.detector << " " << input.detections.size()
         << " boxes " << input.detections.dimension() << " values";
    if (input.calibration) {
      name << " " << text(input.calibration->midpoint) << " " << text(input.calibration->scale);
    }
  }
  for (const TuningSetting& setting : plan.settings) {
    name << " |";
    for (const auto& option : track::tracker_option_table()) {
      name << " " << option.get(setting.options);
    }
  }
  return name.str();
}

}  // namespace

TuningState::TuningState(const std::filesystem::path& path, const TuningPlan& plan,
                         eval::RunGrid& grid)
    : path_(path) {
  if (path_.empty()) return;
  const std::string name = search_name(plan);
  if (std::filesystem::exists(path_)) {
    read(name, grid);
    file_.open(path_, std::ios::app);
    file_ << "\n";  // behind a line that a killed run left unfinished
  } else {
    file_.open(path_);
    file_ << name << "\n";
  }
  check();
}

void TuningState::add(const TuningRun& run, const eval::RunCounts& counts) {
  if (path_.empty()) return;
  const std::scoped_lock lock(mutex_);
  file_ << run.setting << " " << run.sequence << " " << run.draw << " " << counts.tp << " "
        << counts.fp << " " << counts.fn << " " << counts.idsw << " " << counts.idtp << " "
        << counts.idfp << " " << counts.idfn << " .\n"
        << std::flush;
  check();
}

void TuningState::read(const std::string& name, eval::RunGrid& grid) {
  std::istringstream file(io::read_text(path_));
  std::string line;
  if (!std::getline(file, line) || line != name) {
    throw std::invalid_argument(path_.string() +
                                ": is the state of another search, expected a new file");
  }
  while (std::getline(file, line)) {
    std::istringstream words(line);
    TuningRun run;
    eval::RunCounts counts;
    std::string end;
    words >> run.setting >> run.sequence >> run.draw >> counts.tp >> counts.fp >> counts.fn >>
        counts.idsw >> counts.idtp >> counts.idfp >> counts.idfn >> end;
    if (end != "." || run.setting < 0 || run.setting >= grid.settings() || run.sequence < 0 ||
        run.sequence >= grid.sequences() || run.draw < 0 || run.draw >= grid.draws()) {
      continue;  // unfinished: done again
    }
    grid.at(run.setting, run.sequence, run.draw) = counts;
    known_.insert(run);
  }
}

void TuningState::check() const {
  if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
}

}  // namespace sdmt::tuning
