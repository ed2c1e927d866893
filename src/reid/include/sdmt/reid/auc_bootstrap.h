// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace sdmt::reid {

/// The distance between an image of cluster `first` and one of cluster `second` (from 0). A cluster
/// is an identity, or one background image. first == second marks a positive pair.
struct ClusterPair {
  float distance = 0;
  std::int32_t first = 0;
  std::int32_t second = 0;
};

struct BootstrapOptions {
  int draws = 500;           ///< >= 2
  double confidence = 0.95;  ///< mass between low and high, in (0, 1)
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

struct Interval {
  double low = 0;
  double high = 0;
};

/// Where on the curve intervals are wanted beside that of the area.
struct OperatingPoints {
  double tau_a = 0;          ///< threshold of the affinity 1 - d, finite
  double target_fpr = 0.01;  ///< in [0, 1]
};

struct CurveIntervals {
  Interval auc;
  Interval tpr, fpr;  ///< of pairs with 1 - d >= tau_a
  Interval tau_a;     ///< the most permissive that keeps the false positives at or under target_fpr
};

/// Percentile intervals of a curve when identities are drawn again with replacement
/// (pairs are far from independent, identities nearly are). Clusters 0..identities-1 are
/// identities, the `backgrounds` clusters after them are drawn among themselves. A cluster drawn k
/// times weighs its own pairs by k and its pairs with a cluster drawn m times by k * m; a draw left
/// without a positive or a negative pair is skipped. The result depends neither on the order of
/// `pairs` nor on the number of threads. Throws std::invalid_argument when a cluster is out of
/// range, a distance is not finite, or no draw kept both classes.
CurveIntervals bootstrap_curve(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                               const OperatingPoints& points, const BootstrapOptions& options = {});
/// That of the area alone.
Interval bootstrap_auc(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                       const BootstrapOptions& options = {});

}  // namespace sdmt::reid
