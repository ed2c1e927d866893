// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdmt/eval/clear.h"
#include "sdmt/eval/identity.h"

namespace sdmt::eval {

/// What choosing options looks at: the counts behind MOTA and IDF1 of one run over one sequence.
struct RunCounts {
  std::int64_t tp = 0, fp = 0, fn = 0, idsw = 0;
  std::int64_t idtp = 0, idfp = 0, idfn = 0;

  static RunCounts of(const ClearScores& clear, const IdentityScores& identity);
  /// Fractions; 0 without ground truth.
  double mota() const;
  double idf1() const;
  RunCounts& operator+=(const RunCounts& other);
  bool operator==(const RunCounts&) const = default;
};

/// Runs of several settings of a tracker over several sequences, each with several draws of the
/// detections.
class RunGrid {
 public:
  /// `places`, one a sequence: sequences with the same place are left out together. Throws
  /// std::invalid_argument unless there are two places, a setting and a draw.
  RunGrid(std::vector<std::string> places, int settings, int draws);

  int settings() const { return settings_; }
  int sequences() const { return static_cast<int>(places_.size()); }
  int draws() const { return draws_; }
  const std::string& place(int sequence) const { return places_[sequence]; }

  RunCounts& at(int setting, int sequence, int draw);
  const RunCounts& at(int setting, int sequence, int draw) const;

 private:
  std::size_t index(int setting, int sequence, int draw) const;

  std::vector<std::string> places_;
  int settings_, draws_;
  std::vector<RunCounts> runs_;  // [settings, sequences, draws]
};

/// MOTA and IDF1 as fractions: their means over draws of all boxes taken together, and of the
/// sequences, each counting alike.
struct GridScores {
  double pooled_mota = 0, pooled_idf1 = 0;
  double mean_mota = 0, mean_idf1 = 0;

  /// What settings are chosen by: each sequence and each of the two scores counts alike.
  double objective() const { return mean_mota + mean_idf1; }
};

/// The scores of `setting[i]` on sequence i.
GridScores grid_scores(const RunGrid& grid, std::span<const int> setting);

/// How much better one setting a sequence is than another, by the mean over the draws: the mean
/// over the sequences, and its standard error, which says what other sequences would bring (0 for a
/// single one).
struct PairedGain {
  double mota = 0, idf1 = 0;
  double mota_error = 0, idf1_error = 0;
};
PairedGain paired_gain(const RunGrid& grid, std::span<const int> setting,
                       std::span<const int> other);

/// The setting among `allowed` with the best objective over the sequences that are not of
/// `left_out`; the first of equals. An empty place leaves out nothing.
int best_setting(const RunGrid& grid, std::span<const int> allowed, const std::string& left_out);

/// Leave one out: for each sequence the setting that is best on the places of all others. What
/// these reach is what a choice on the given sequences brings elsewhere; what the best of all
/// reaches on the sequences that it was chosen on is more.
std::vector<int> held_out_settings(const RunGrid& grid, std::span<const int> allowed);

}  // namespace sdmt::eval
