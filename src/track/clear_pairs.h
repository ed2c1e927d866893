// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "sdmt/mot/overlaps.h"

namespace sdmt::track {

/// The pairs of a tracklet and a detection that motion alone leaves no doubt about: neither passes
/// the motion gate with anybody else, and they overlap by half as much again as it asks. Keeps its
/// memory.
class ClearPairs {
 public:
  /// `gated`: pairs that pass the motion gate `min_iou`, a: tracklet, b: detection.
  void find(const std::vector<mot::Overlap>& gated, std::size_t tracklets, std::size_t detections,
            double min_iou);

  /// -1 where there is a doubt.
  int tracklet_of(std::size_t detection) const { return tracklet_of_[detection]; }
  std::size_t detections() const { return tracklet_of_.size(); }

 private:
  std::vector<int> detections_near_, tracklets_near_, tracklet_of_;
};

}  // namespace sdmt::track
