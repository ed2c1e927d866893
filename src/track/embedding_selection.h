// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "frame_detections.h"
#include "sdmt/mot/overlaps.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Chooses the detections of a frame to embed. EmbedPolicy::always: the strong ones.
/// EmbedPolicy::needed: of those, all but the ones that are
///  - unambiguous: the detection passes the motion gate of exactly one tracklet, and that
///    tracklet's gate is passed by no other detection, and by this one clearly: with an overlap of
///    1.5 min_iou;
///  - and continue a known tracklet: it is confirmed (min_length detections), had its detection in
///    the last frame, and its gallery is fresh.
/// Such a detection is assigned by motion and its appearance is not stored. So births, crossings,
/// young tracklets and returns are looked at, and everybody now and then (`everybody`), all in one
/// frame, because the network is quicker with many crops at once.
class EmbeddingSelection {
 public:
  EmbeddingSelection(const AppearanceOptions& options, const AssignmentOptions& assignment,
                     const ConfidenceOptions& confidence)
      : options_(options), assignment_(assignment), confidence_(confidence) {}

  /// Indices into `detections`, ascending; the reference holds until the next call.
  const std::vector<std::size_t>& choose(int frame, bool everybody, const Tracklets& active,
                                         const FrameDetections& detections,
                                         const std::vector<mot::Overlap>& gated);

 private:
  bool known(const Tracklet& tracklet, int frame) const;

  const AppearanceOptions& options_;
  const AssignmentOptions& assignment_;
  const ConfidenceOptions& confidence_;
  std::vector<std::size_t> chosen_;
  std::vector<int> detections_near_;  // [active] pairs in the gate
  std::vector<int> tracklets_near_;   // [detections]
  std::vector<int> tracklet_of_;      // [detections] the last of them
  std::vector<double> overlap_;       // [detections] with it
};

}  // namespace sdmt::track
