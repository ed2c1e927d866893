// SPDX-License-Identifier: Apache-2.0
#include "clear_pairs.h"

namespace sdmt::track {

void ClearPairs::find(const std::vector<mot::Overlap>& gated, std::size_t tracklets,
                      std::size_t detections, double min_iou) {
  constexpr double kClearlyInside = 1.5;
  detections_near_.assign(tracklets, 0);
  tracklets_near_.assign(detections, 0);
  tracklet_of_.assign(detections, -1);
  for (const mot::Overlap& pair : gated) {
    ++detections_near_[pair.a];
    ++tracklets_near_[pair.b];
  }
  for (const mot::Overlap& pair : gated) {
    if (detections_near_[pair.a] == 1 && tracklets_near_[pair.b] == 1 &&
        pair.iou >= kClearlyInside * min_iou) {
      tracklet_of_[pair.b] = pair.a;
    }
  }
}

}  // namespace sdmt::track
