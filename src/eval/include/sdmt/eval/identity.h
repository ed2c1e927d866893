// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

/// Identity scores (Ristani et al. 2016) at similarity 0.5: how much of the ground truth is covered
/// when each person may be explained by one result id only. Ratios are fractions.
struct IdentityScores {
  std::int64_t idtp = 0, idfn = 0, idfp = 0;  ///< boxes
  double idf1 = 0;                            ///< 2 idtp / (ground-truth boxes + result boxes)
  double idp = 0;                             ///< idtp / result boxes
  double idr = 0;                             ///< idtp / ground-truth boxes
};

/// One assignment of people to result ids over the whole sequence that maximises idtp.
IdentityScores identity(const SequenceSimilarities& sequence);

/// Adds up the counts of several sequences and takes the ratios of the sums.
IdentityScores combine(std::span<const IdentityScores> sequences);

}  // namespace sdmt::eval
