// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::track {

/// Why two tracklets were or were not made one track.
enum class AssociationVerdict {
  merged,
  too_far,      ///< the newer tracklet's first box lies too far from the older one's prediction
  appearance,   ///< affinity not above the threshold
  no_feature,   ///< one of them has no stored appearance
  better_pair,  ///< one of them was merged with another tracklet
};
const char* to_string(AssociationVerdict verdict);

/// A decision of tracklet association (section III-G of the paper) about a pair of tracklets.
struct AssociationDecision {
  int frame = 0;             ///< in which it was made
  int older = 0, newer = 0;  ///< ids
  int gap = 0;               ///< frames between the older one's last and the newer one's first box
  double affinity = 0;       ///< of appearance (NaN where unknown)
  AssociationVerdict verdict = AssociationVerdict::merged;
};

}  // namespace sdmt::track
