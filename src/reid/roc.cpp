// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/roc.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdmt::reid {

namespace {

std::vector<float> sorted(std::span<const float> distances) {
  std::vector<float> result(distances.begin(), distances.end());
  for (const float d : result) {
    if (!std::isfinite(d)) throw std::invalid_argument("ROC: a distance is not finite");
  }
  std::sort(result.begin(), result.end());
  return result;
}

// Merges the two sorted classes into one row for each distinct distance.
std::vector<DistanceCount> count(std::span<const float> positives,
                                 std::span<const float> negatives) {
  const auto p = sorted(positives);
  const auto n = sorted(negatives);
  std::vector<DistanceCount> counts;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < p.size() || j < n.size()) {
    const float d = i == p.size() ? n[j] : j == n.size() ? p[i] : std::min(p[i], n[j]);
    DistanceCount row{d, 0, 0};
    for (; i < p.size() && p[i] == d; ++i) ++row.positives;
    for (; j < n.size() && n[j] == d; ++j) ++row.negatives;
    counts.push_back(row);
  }
  return counts;
}

void check_rate(const char* name, double rate) {
  if (!(rate >= 0.0 && rate <= 1.0)) {
    throw std::invalid_argument(std::string("ROC: ") + name + " is " + std::to_string(rate) +
                                ", expected 0 to 1");
  }
}

}  // namespace

Roc::Roc(std::span<const float> positives, std::span<const float> negatives)
    : Roc(count(positives, negatives)) {}

Roc::Roc(std::vector<DistanceCount> counts) : counts_(std::move(counts)) {
  std::erase_if(counts_, [](const DistanceCount& c) { return c.positives + c.negatives == 0; });
  positives_upto_.reserve(counts_.size() + 1);
  negatives_upto_.reserve(counts_.size() + 1);
  positives_upto_.push_back(0);
  negatives_upto_.push_back(0);
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    const DistanceCount& c = counts_[i];
    if (!std::isfinite(c.distance) || (i > 0 && c.distance <= counts_[i - 1].distance)) {
      throw std::invalid_argument("ROC: distances must be finite and ascend, got " +
                                  std::to_string(c.distance) + " at row " + std::to_string(i));
    }
    positives_upto_.push_back(positives_ += c.positives);
    negatives_upto_.push_back(negatives_ += c.negatives);
  }
  if (positives_ == 0) throw std::invalid_argument("ROC: there is no positive pair");
  if (negatives_ == 0) throw std::invalid_argument("ROC: there is no negative pair");
}

double Roc::tpr(std::size_t i) const {
  return static_cast<double>(positives_upto_[i]) / static_cast<double>(positives_);
}

double Roc::fpr(std::size_t i) const {
  return static_cast<double>(negatives_upto_[i]) / static_cast<double>(negatives_);
}

double Roc::threshold_after(std::size_t i) const {
  if (i == 0) return std::max(0.0, 0.5 * counts_.front().distance);
  if (i == counts_.size()) return counts_.back().distance;
  return 0.5 * (counts_[i - 1].distance + counts_[i].distance);
}

double Roc::auc() const {
  // Twice Mann-Whitney's U in exact integers would overflow 64 bits for 10^10 x 10^10 pairs; long
  // double holds every partial sum of realistic sizes exactly.
  long double twice = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    twice += static_cast<long double>(counts_[i].negatives) *
             static_cast<long double>(positives_upto_[i] + positives_upto_[i + 1]);
  }
  return static_cast<double>(twice / 2 / static_cast<long double>(positives_) /
                             static_cast<long double>(negatives_));
}

double Roc::eer() const {
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    const double before = 1.0 - tpr(i) - fpr(i);  // falls from 1 to -1
    const double after = 1.0 - tpr(i + 1) - fpr(i + 1);
    if (after <= 0.0) {
      const double part = before / (before - after);
      return fpr(i) + part * (fpr(i + 1) - fpr(i));
    }
  }
  return 0.5;  // not reached: the last point has tpr + fpr == 2
}

double Roc::tpr_at_fpr(double target) const {
  check_rate("fpr", target);
  // The highest point at or left of the target, then along the segment to the next.
  std::size_t i = counts_.size();
  while (fpr(i) > target) --i;
  if (i == counts_.size()) return 1.0;
  const double part = (target - fpr(i)) / (fpr(i + 1) - fpr(i));
  return tpr(i) + part * (tpr(i + 1) - tpr(i));
}

double Roc::fpr_at_tpr(double target) const {
  check_rate("tpr", target);
  std::size_t i = 0;
  while (tpr(i) < target) ++i;
  if (i == 0) return 0.0;
  const double part = (target - tpr(i - 1)) / (tpr(i) - tpr(i - 1));
  return fpr(i - 1) + part * (fpr(i) - fpr(i - 1));
}

namespace {

template <typename Accuracy>
std::size_t argmax(std::size_t size, Accuracy accuracy) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < size; ++i) {
    if (accuracy(i) > accuracy(best)) best = i;
  }
  return best;
}

}  // namespace

double Roc::accuracy() const {
  const auto value = [this](std::size_t i) { return 0.5 * (tpr(i) + 1.0 - fpr(i)); };
  return value(argmax(positives_upto_.size(), value));
}

double Roc::tau_a_max_accuracy() const {
  const auto best =
      argmax(positives_upto_.size(), [this](std::size_t i) { return tpr(i) - fpr(i); });
  return 1.0 - threshold_after(best);
}

double Roc::tau_a_eer() const {
  std::size_t i = 0;
  while (1.0 - tpr(i) > fpr(i)) ++i;
  // i is the first point past the crossing; the one before may be nearer to it.
  if (i > 0 && fpr(i) + tpr(i) - 1.0 >= 1.0 - tpr(i - 1) - fpr(i - 1)) --i;
  return 1.0 - threshold_after(i);
}

double Roc::tau_a_at_fpr(double target) const {
  check_rate("fpr", target);
  std::size_t i = counts_.size();
  while (fpr(i) > target) --i;
  return 1.0 - threshold_after(i);
}

double Roc::tau_a_histogram_crossing() const {
  constexpr int kBins = 100;
  const DistanceHistogram h = distance_histogram(*this, kBins);
  std::size_t bin = 0;
  for (double mass = h.positives[0]; mass < 0.5; mass += h.positives[bin]) ++bin;
  const auto excess = [&h](std::size_t i) { return h.positives[i] - h.negatives[i]; };
  const auto centre = [&h](std::size_t i) { return (static_cast<double>(i) + 0.5) * h.bin_width; };
  if (excess(bin) <= 0) return 1.0 - centre(bin);
  for (; bin + 1 < h.positives.size(); ++bin) {
    if (excess(bin + 1) < 0) {
      const double part = excess(bin) / (excess(bin) - excess(bin + 1));
      return 1.0 - (centre(bin) + part * h.bin_width);
    }
  }
  return 1.0 - counts_.back().distance;  // the negatives never outweigh the positives
}

RocPoint Roc::at(double distance) const {
  const auto beyond = std::upper_bound(
      counts_.begin(), counts_.end(), distance,
      [](double value, const DistanceCount& count) { return value < count.distance; });
  const auto i = static_cast<std::size_t>(beyond - counts_.begin());
  return {distance, tpr(i), fpr(i)};
}

std::vector<RocPoint> Roc::points() const {
  std::vector<RocPoint> result;
  result.reserve(positives_upto_.size());
  for (std::size_t i = 0; i < positives_upto_.size(); ++i) {
    result.push_back({threshold_after(i), tpr(i), fpr(i)});
  }
  return result;
}

DistanceHistogram distance_histogram(const Roc& roc, int bins) {
  if (bins < 1) {
    throw std::invalid_argument("distance_histogram: bins is " + std::to_string(bins) +
                                ", expected at least 1");
  }
  const double largest = roc.counts().back().distance;
  DistanceHistogram h;
  h.bin_width = largest > 0 ? largest / bins : 1.0 / bins;
  h.positives.assign(static_cast<std::size_t>(bins), 0.0);
  h.negatives.assign(static_cast<std::size_t>(bins), 0.0);
  for (const DistanceCount& c : roc.counts()) {
    const auto bin = static_cast<std::size_t>(
        std::clamp(static_cast<int>(c.distance / h.bin_width), 0, bins - 1));
    h.positives[bin] += static_cast<double>(c.positives) / static_cast<double>(roc.positives());
    h.negatives[bin] += static_cast<double>(c.negatives) / static_cast<double>(roc.negatives());
  }
  return h;
}

}  // namespace sdmt::reid
