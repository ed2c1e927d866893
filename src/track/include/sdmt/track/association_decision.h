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
  too_late,     ///< the newer one began beyond the horizon
};
const char* to_string(AssociationVerdict verdict);

/// A decision of tracklet association (section III-G of the paper) about a pair of tracklets.
struct AssociationDecision {
  int frame = 0;             ///< in which it was made
  int older = 0, newer = 0;  ///< ids
  int gap = 0;               ///< frames between the older one's last and the newer one's first box
  double affinity = 0;       ///< of appearance (NaN where unknown)
  double threshold = 0;      ///< that the affinity must exceed (NaN where motion decided)
  AssociationVerdict verdict = AssociationVerdict::merged;
};

/// A tracklet that came to nothing: it missed too many detections before it was a track (section
/// III-E). Its boxes are in no output.
struct DroppedTracklet {
  int frame = 0;  ///< in which it was given up
  int id = 0;
  int first_frame = 0, last_frame = 0;
  int length = 0;  ///< detections, of which ConfidenceOptions asks for min_length
  double mean_score = 0;
};

}  // namespace sdmt::track
