// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/track/tracker_options.h"
#include "sdmt/tuning/tuning_sequence.h"

namespace sdmt::tuning {

/// An option of the tracker, named as in track::tracker_option_table(), with the values to try as
/// it takes them; switches also as on and off.
struct TunedOption {
  std::string name;
  std::vector<std::string> values;
};

/// What is to be tried, and on what.
struct TuningOptions {
  static constexpr int kMostSettings = 100'000;
  static constexpr int kMostDraws = 1000;
  static constexpr double kMostDrop = 0.9;

  std::vector<std::string> sequences;  ///< as read_sequences() takes them, of two places at least
  std::vector<TunedOption> tuned;      ///< one at least
  int settings = 200;      ///< the most to run, of more combinations so many are drawn; >= 1
  int draws = 4;           ///< runs of a setting over a sequence, the first with all boxes; >= 1
  double drop = 0.02;      ///< share of boxes left out in the other draws, >= 0
  std::uint64_t seed = 1;  ///< of the draws and of the settings that are drawn

  /// Throws std::invalid_argument naming field, value and range.
  void validate() const;
};

/// Options to run.
struct TuningSetting {
  track::TrackerOptions options;
  std::vector<std::string> values;  ///< of the tuned options, in their order
};

/// What is run: every setting over every sequence, in each draw.
struct TuningPlan {
  std::vector<TuningSequence> sequences;
  std::vector<std::string> tuned;       ///< names of the options
  std::vector<TuningSetting> settings;  ///< the base first
  int draws = 4;
  double drop = 0.02;
  std::uint64_t seed = 1;
  std::optional<double> tau_a;  ///< of the detections' embeddings; nothing: motion alone

  /// Of all sequences.
  std::int64_t frames() const;
  /// Of the settings and of ByteTrack.
  std::int64_t runs() const;
};

/// Reads the sequences and combines the values: the base and all combinations, or so many of them,
/// drawn, the base among them. Combinations that TrackerOptions::validate() refuses are left out.
/// Throws std::invalid_argument as `options`, `base` and read_sequences() do, for an option that
/// the tracker does not have or that is given twice, a value that it does not take, sequences of a
/// single place, and more than 1,000,000 combinations.
TuningPlan make_plan(const TuningOptions& options, const track::TrackerOptions& base);

}  // namespace sdmt::tuning
