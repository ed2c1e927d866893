// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_plan.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/tracker_option_table.h"
#include "tuning_grid.h"

namespace sdmt::tuning {

namespace {

const io::Option<track::TrackerOptions>& tracker_option(const std::string& name) {
  return track::tracker_option_table().named(name, "tracker");
}

// The values as the option writes them.
TunedOption checked(const TunedOption& tuned) {
  const auto& option = tracker_option(tuned.name);
  TunedOption written{tuned.name, {}};
  for (const std::string& value : tuned.values) {
    const bool on_off = option.is_switch && (value == "on" || value == "off");
    track::TrackerOptions options;
    option.set(options, !on_off ? value : value == "on" ? "true" : "false");
    option.check(options);
    written.values.push_back(option.get(options));
  }
  if (written.values.empty()) {
    throw std::invalid_argument("option " + tuned.name + " has no values, expected one at least");
  }
  return written;
}

std::vector<TunedOption> checked(const std::vector<TunedOption>& tuned) {
  std::vector<TunedOption> written;
  for (const TunedOption& option : tuned) {
    const auto same = [&](const TunedOption& other) { return other.name == option.name; };
    if (std::any_of(written.begin(), written.end(), same)) {
      throw std::invalid_argument("option " + option.name + " is given twice");
    }
    written.push_back(checked(option));
  }
  return written;
}

// Numbers of combinations, all of them or so many drawn.
std::vector<std::uint64_t> combinations_of(const std::vector<TunedOption>& tuned, int most,
                                           std::uint64_t seed) {
  std::uint64_t combinations = 1;
  for (const TunedOption& option : tuned) {
    combinations *= option.values.size();
    if (combinations > 1'000'000) {
      throw std::invalid_argument(
          "options have more than 1,000,000 combinations, expected fewer options or values");
    }
  }
  std::vector<std::uint64_t> order(combinations);
  for (std::uint64_t i = 0; i < combinations; ++i) order[i] = i;
  if (combinations > static_cast<std::uint64_t>(most)) {
    nn::Random random(seed);
    random.shuffle(std::span(order));
  }
  return order;
}

std::vector<TuningSetting> settings_of(const track::TrackerOptions& base,
                                       const std::vector<TunedOption>& tuned, int most,
                                       std::uint64_t seed) {
  TuningSetting first{base, {}};
  for (const TunedOption& option : tuned) {
    first.values.push_back(tracker_option(option.name).get(base));
  }
  std::vector<TuningSetting> settings{first};
  for (std::uint64_t combination : combinations_of(tuned, most, seed)) {
    if (static_cast<int>(settings.size()) >= most) break;
    TuningSetting setting{base, {}};
    for (const TunedOption& option : tuned) {
      setting.values.push_back(option.values[combination % option.values.size()]);
      tracker_option(option.name).set(setting.options, setting.values.back());
      combination /= option.values.size();
    }
    if (setting.values == first.values) continue;
    try {
      setting.options.validate();
    } catch (const std::invalid_argument&) {
      continue;
    }
    settings.push_back(std::move(setting));
  }
  return settings;
}

}  // namespace

void TuningOptions::validate() const {
  if (tuned.empty()) io::refuse_value("options", "none", "one at least");
  io::require_in("settings", settings, 1, kMostSettings);
  io::require_in("draws", draws, 1, kMostDraws);
  io::require_in("drop", drop, 0.0, kMostDrop);
}

std::int64_t TuningPlan::frames() const {
  std::int64_t frames = 0;
  for (const TuningSequence& input : sequences) frames += input.gt.num_frames;
  return frames;
}

std::int64_t TuningPlan::runs() const {
  return static_cast<std::int64_t>(settings.size() + 1) *
         static_cast<std::int64_t>(sequences.size()) * draws;
}

TuningPlan make_plan(const TuningOptions& options, const track::TrackerOptions& base) {
  options.validate();
  base.validate();
  const auto tuned = checked(options.tuned);
  TuningPlan plan;
  plan.sequences = read_sequences(options.sequences);
  for (const TunedOption& option : tuned) plan.tuned.push_back(option.name);
  plan.settings = settings_of(base, tuned, options.settings, options.seed);
  plan.draws = options.draws;
  plan.drop = options.drop;
  plan.seed = options.seed;
  static_cast<void>(empty_grid(plan));  // refuses sequences of a single place before the work
  return plan;
}

}  // namespace sdmt::tuning
