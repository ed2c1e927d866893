// SPDX-License-Identifier: Apache-2.0
#include "embedding_selection.h"

namespace sdmt::track {

namespace {

// An overlap below this many times the motion gate is a doubtful one.
constexpr double kClearlyInside = 1.5;

}  // namespace

bool EmbeddingSelection::known(const Tracklet& tracklet, int frame) const {
  return tracklet.confidence.length >= confidence_.min_length && tracklet.misses == 0 &&
         !tracklet.gallery.empty() && frame - tracklet.feature_frame < options_.embed_refresh;
}

const std::vector<std::size_t>& EmbeddingSelection::choose(int frame, bool everybody,
                                                           const Tracklets& active,
                                                           const FrameDetections& detections,
                                                           const std::vector<mot::Overlap>& gated) {
  detections_near_.assign(active.size(), 0);
  tracklets_near_.assign(detections.size(), 0);
  tracklet_of_.assign(detections.size(), -1);
  overlap_.assign(detections.size(), 0);
  for (const mot::Overlap& pair : gated) {
    ++detections_near_[pair.a];
    ++tracklets_near_[pair.b];
    tracklet_of_[pair.b] = pair.a;
    overlap_[pair.b] = pair.iou;
  }
  chosen_.clear();
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (!detections.flags[i].strong) continue;
    if (options_.embed == EmbedPolicy::needed && !everybody && tracklets_near_[i] == 1) {
      const int near = tracklet_of_[i];
      if (detections_near_[near] == 1 && overlap_[i] >= kClearlyInside * assignment_.min_iou &&
          known(*active[near], frame)) {
        continue;
      }
    }
    chosen_.push_back(i);
  }
  return chosen_;
}

}  // namespace sdmt::track
