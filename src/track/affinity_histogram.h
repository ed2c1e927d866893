// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace sdmt::track {

/// The distribution of affinities (-1..1) of one kind, in a fixed amount of memory: some 65,000
/// observations, of which older ones count half, a quarter, ... of newer ones.
class AffinityHistogram {
 public:
  void add(double affinity);

  std::int64_t count() const { return count_; }
  /// The affinity that this share (0..1) of the observations exceeds, between two bins in
  /// proportion. There must be some.
  double exceeded_by(double share) const;
  /// The share of the observations above an affinity. There must be some.
  double share_above(double affinity) const;

 private:
  friend struct Snapshot;

  static constexpr int kBins = 1000;
  static constexpr std::int64_t kMost = 1 << 16;

  std::array<std::int32_t, kBins> bins_{};
  std::int64_t count_ = 0;
};

}  // namespace sdmt::track
