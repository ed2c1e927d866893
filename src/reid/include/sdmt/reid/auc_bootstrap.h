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

struct AucInterval {
  double low = 0;
  double high = 0;
};

/// Percentile interval of the area under the curve when identities are drawn again with replacement
/// (pairs are far from independent, identities nearly are). Clusters 0..identities-1 are
/// identities, the `backgrounds` clusters after them are drawn among themselves. A cluster drawn k
/// times weighs its own pairs by k and its pairs with a cluster drawn m times by k * m; a draw left
/// without a positive or a negative pair is skipped. The result depends neither on the order of
/// `pairs` nor on the number of threads. Throws std::invalid_argument when a cluster is out of
/// range, a distance is not finite, or no draw kept both classes.
AucInterval bootstrap_auc(std::vector<ClusterPair> pairs, int identities, int backgrounds,
                          const BootstrapOptions& options = {});

}  // namespace sdmt::reid
