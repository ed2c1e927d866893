// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/io/range.h"
#include "sdmt/train/training_set.h"

namespace sdmt::train {

struct PkSamplerOptions {
  static constexpr io::Range kIdentities{.low = 2};
  static constexpr io::Range kInstances{.low = 2};

  int identities = 32;  ///< P: people in a batch (the paper's section IV-A), >= 2
  int instances = 4;    ///< K: images of each, >= 2
  /// Relative share of the batch's people that comes from each source; empty: as many as the source
  /// has people. Otherwise one value >= 0 for each source, not all 0.
  std::vector<double> source_weights;
  std::uint64_t seed = 0;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Draws batches of P people x K images. People of a source follow one another in a random order in
/// which each comes once, then in the next order; no person is twice in a batch (the few people
/// that do not fill a batch wait for the next order). Images of a person are drawn without
/// replacement; one with n < K images gives all n, and K - n of them again.
/// A batch depends on the seed and its number only.
class PkSampler {
 public:
  struct Batch {
    std::vector<int> images;  ///< P * K indices into TrainingSet::images, person after person
    std::vector<int> labels;  ///< index into the identities, for each image
  };

  /// `identities` must outlive the sampler. Throws std::invalid_argument as the options do, and
  /// when a source has fewer people than its share of a batch.
  PkSampler(std::span<const Identity> identities, int sources, PkSamplerOptions options);

  /// People of a batch that come from each source.
  const std::vector<int>& source_counts() const { return counts_; }

  Batch batch(std::int64_t iteration);

 private:
  struct Source {
    std::vector<int> people;  // indices into identities_
    std::vector<int> order;   // of epoch `epoch`
    std::int64_t epoch = -1;
  };

  std::span<const Identity> identities_;
  PkSamplerOptions options_;
  std::vector<Source> sources_;
  std::vector<int> counts_;
};

}  // namespace sdmt::train
