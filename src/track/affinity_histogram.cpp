// SPDX-License-Identifier: Apache-2.0
#include "affinity_histogram.h"

#include <algorithm>

namespace sdmt::track {

namespace {

double place(double affinity, int bins) { return (affinity + 1) / 2 * bins; }

}  // namespace

void AffinityHistogram::add(double affinity) {
  ++bins_[std::clamp(static_cast<int>(place(affinity, kBins)), 0, kBins - 1)];
  if (++count_ < kMost) return;
  count_ = 0;
  for (auto& bin : bins_) {
    bin /= 2;
    count_ += bin;
  }
}

double AffinityHistogram::exceeded_by(double share) const {
  const double above = share * static_cast<double>(count_);
  double sum = 0;
  int bin = kBins;
  while (bin > 0 && sum + bins_[bin - 1] <= above) sum += bins_[--bin];
  if (bin == 0) return -1;
  const double part = (above - sum) / bins_[bin - 1];
  return (bin - part) * 2 / kBins - 1;
}

double AffinityHistogram::share_above(double affinity) const {
  const double at = std::clamp(place(affinity, kBins), 0.0, static_cast<double>(kBins));
  const int bin = std::min(static_cast<int>(at), kBins - 1);
  double sum = bins_[bin] * (bin + 1 - at);
  for (int i = bin + 1; i < kBins; ++i) sum += bins_[i];
  return sum / static_cast<double>(count_);
}

}  // namespace sdmt::track
