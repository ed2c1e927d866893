// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "clear_pairs.h"
#include "frame_detections.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Chooses the detections of a frame to embed. EmbedPolicy::always: the strong ones.
/// EmbedPolicy::needed: of those, all but the ones that are
///  - clear by motion (ClearPairs);
///  - and continue a known tracklet: it is confirmed (min_length detections), had its detection in
///    the last frame, and its gallery is fresh.
/// Such a detection is assigned by motion and its appearance is not stored. So births, crossings,
/// young tracklets and returns are looked at, and everybody now and then (`everybody`), all in one
/// frame, because the network is quicker with many crops at once.
class EmbeddingSelection {
 public:
  EmbeddingSelection(const AppearanceOptions& options, const ConfidenceOptions& confidence)
      : options_(options), confidence_(confidence) {}

  /// Indices into `detections`, ascending; the reference holds until the next call.
  const std::vector<std::size_t>& choose(int frame, bool everybody, const Tracklets& active,
                                         const FrameDetections& detections,
                                         const ClearPairs& clear);

 private:
  bool known(const Tracklet& tracklet, int frame) const;

  const AppearanceOptions& options_;
  const ConfidenceOptions& confidence_;
  std::vector<std::size_t> chosen_;
};

}  // namespace sdmt::track
