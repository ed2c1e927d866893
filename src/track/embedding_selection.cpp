// SPDX-License-Identifier: Apache-2.0
#include "embedding_selection.h"

namespace sdmt::track {

bool EmbeddingSelection::known(const Tracklet& tracklet, int frame) const {
  return tracklet.confidence.length >= confidence_.min_length && tracklet.misses == 0 &&
         !tracklet.gallery.empty() && frame - tracklet.feature_frame < options_.embed_refresh;
}

const std::vector<std::size_t>& EmbeddingSelection::choose(int frame, bool everybody,
                                                           const Tracklets& active,
                                                           const FrameDetections& detections,
                                                           const ClearPairs& clear) {
  chosen_.clear();
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (!detections.flags[i].strong) continue;
    const int tracklet = clear.tracklet_of(i);
    const bool needed = options_.embed == EmbedPolicy::always || everybody || tracklet < 0 ||
                        !known(*active[tracklet], frame);
    if (needed) chosen_.push_back(i);
  }
  return chosen_;
}

}  // namespace sdmt::track
