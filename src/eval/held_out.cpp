// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/held_out.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace sdmt::eval {

namespace {

double ratio(std::int64_t part, std::int64_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0;
}

// Means over the draws on one sequence.
std::pair<double, double> sequence_scores(const RunGrid& grid, int setting, int sequence) {
  double mota = 0, idf1 = 0;
  for (int draw = 0; draw < grid.draws(); ++draw) {
    const RunCounts& run = grid.at(setting, sequence, draw);
    mota += run.mota();
    idf1 += run.idf1();
  }
  return {mota / grid.draws(), idf1 / grid.draws()};
}

// The mean of values and its standard error.
std::pair<double, double> mean_and_error(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, n > 1 ? std::sqrt(squares / (n - 1) / n) : 0};
}

}  // namespace

RunCounts RunCounts::of(const ClearScores& clear, const IdentityScores& identity) {
  return {clear.clr_tp,  clear.clr_fp,  clear.clr_fn, clear.idsw,
          identity.idtp, identity.idfp, identity.idfn};
}

double RunCounts::mota() const { return ratio(tp - fp - idsw, tp + fn); }

double RunCounts::idf1() const { return ratio(2 * idtp, 2 * idtp + idfp + idfn); }

RunCounts& RunCounts::operator+=(const RunCounts& other) {
  tp += other.tp, fp += other.fp, fn += other.fn, idsw += other.idsw;
  idtp += other.idtp, idfp += other.idfp, idfn += other.idfn;
  return *this;
}

RunGrid::RunGrid(std::vector<std::string> places, int settings, int draws)
    : places_(std::move(places)), settings_(settings), draws_(draws) {
  if (std::set(places_.begin(), places_.end()).size() < 2) {
    throw std::invalid_argument(
        "sequences are of one place, expected two at least: one is left out");
  }
  if (settings < 1 || draws < 1) {
    throw std::invalid_argument("settings or draws are none, expected one at least");
  }
  runs_.resize(static_cast<std::size_t>(settings) * places_.size() *
               static_cast<std::size_t>(draws));
}

std::size_t RunGrid::index(int setting, int sequence, int draw) const {
  const auto row = static_cast<std::size_t>(setting) * places_.size();
  return (row + static_cast<std::size_t>(sequence)) * static_cast<std::size_t>(draws_) +
         static_cast<std::size_t>(draw);
}

RunCounts& RunGrid::at(int setting, int sequence, int draw) {
  return runs_[index(setting, sequence, draw)];
}

const RunCounts& RunGrid::at(int setting, int sequence, int draw) const {
  return runs_[index(setting, sequence, draw)];
}

GridScores grid_scores(const RunGrid& grid, std::span<const int> setting) {
  GridScores scores;
  for (int draw = 0; draw < grid.draws(); ++draw) {
    RunCounts all;
    for (int i = 0; i < grid.sequences(); ++i) all += grid.at(setting[i], i, draw);
    scores.pooled_mota += all.mota() / grid.draws();
    scores.pooled_idf1 += all.idf1() / grid.draws();
  }
  for (int i = 0; i < grid.sequences(); ++i) {
    const auto [mota, idf1] = sequence_scores(grid, setting[i], i);
    scores.mean_mota += mota / grid.sequences();
    scores.mean_idf1 += idf1 / grid.sequences();
  }
  return scores;
}

PairedGain paired_gain(const RunGrid& grid, std::span<const int> setting,
                       std::span<const int> other) {
  std::vector<double> mota, idf1;
  for (int i = 0; i < grid.sequences(); ++i) {
    const auto with = sequence_scores(grid, setting[i], i);
    const auto without = sequence_scores(grid, other[i], i);
    mota.push_back(with.first - without.first);
    idf1.push_back(with.second - without.second);
  }
  PairedGain gain;
  std::tie(gain.mota, gain.mota_error) = mean_and_error(mota);
  std::tie(gain.idf1, gain.idf1_error) = mean_and_error(idf1);
  return gain;
}

int best_setting(const RunGrid& grid, std::span<const int> allowed, const std::string& left_out) {
  int best = allowed.front();
  double best_sum = -1e300;
  for (const int setting : allowed) {
    double sum = 0;
    for (int i = 0; i < grid.sequences(); ++i) {
      if (grid.place(i) == left_out) continue;
      const auto [mota, idf1] = sequence_scores(grid, setting, i);
      sum += mota + idf1;
    }
    if (sum > best_sum) {
      best_sum = sum;
      best = setting;
    }
  }
  return best;
}

std::vector<int> held_out_settings(const RunGrid& grid, std::span<const int> allowed) {
  std::map<std::string, int> best;
  std::vector<int> settings;
  for (int i = 0; i < grid.sequences(); ++i) {
    const std::string& place = grid.place(i);
    if (!best.contains(place)) best[place] = best_setting(grid, allowed, place);
    settings.push_back(best[place]);
  }
  return settings;
}

}  // namespace sdmt::eval
