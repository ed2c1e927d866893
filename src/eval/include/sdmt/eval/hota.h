// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sdmt/eval/similarities.h"

namespace sdmt::eval {

inline constexpr std::size_t kNumAlphas = 19;

/// Localisation thresholds 0.05, 0.10, ... 0.95.
std::array<double, kNumAlphas> hota_alphas();

/// A score at each localisation threshold.
using AlphaScores = std::array<double, kNumAlphas>;
using AlphaCounts = std::array<std::int64_t, kNumAlphas>;

/// HOTA (Luiten et al. 2021): detection and association weighed alike. The single figures that
/// people quote are means over the thresholds, see mean(); all are fractions.
struct HotaScores {
  AlphaScores hota{};  ///< sqrt(deta * assa)
  AlphaScores deta{}, detre{}, detpr{};
  AlphaScores assa{}, assre{}, asspr{};
  AlphaScores loca{};  ///< mean similarity of matched boxes
  AlphaScores owta{};  ///< sqrt(detre * assa): for ground truth that is not complete
  AlphaCounts hota_tp{}, hota_fn{}, hota_fp{};
  double hota_0 = 0;      ///< hota at the first threshold ("HOTA(0)")
  double loca_0 = 0;      ///< loca at the first threshold
  double hotaloca_0 = 0;  ///< their product
};

double mean(const AlphaScores& scores);

/// Scores one sequence. As in TrackEval, a sequence without results or without ground truth has
/// loca 1 and every other ratio 0.
HotaScores hota(const SequenceSimilarities& sequence);

/// Adds up the counts of several sequences; association and localisation are averaged weighted by
/// matched boxes, the rest follows from the sums.
HotaScores combine(std::span<const HotaScores> sequences);

}  // namespace sdmt::eval
