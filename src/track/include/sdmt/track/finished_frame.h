// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/mot/box.h"

namespace sdmt::track {

/// Where a reported box comes from.
enum class BoxSource {
  detected,  ///< a detection was assigned in this frame
  boosted,   ///< found by appearance where the detector found nothing (section III-F of the paper)
  interpolated,  ///< between two boxes of the track; nobody saw it
};
const char* to_string(BoxSource source);

struct TrackedBox {
  int id = 0;     ///< 1-based, unique within a tracker and within a frame
  mot::Tlwh box;  ///< in the coordinates of the detections
  /// Score of the detection (its probability where a calibration is set); 0 for boxes of other
  /// sources.
  double score = 0;
  BoxSource source = BoxSource::detected;
};

/// From this frame on the person known as `from` is reported as `to`, the older id.
struct IdMerge {
  int from = 0;
  int to = 0;
};

/// A frame about which the tracker will not change its mind.
struct FinishedFrame {
  int frame = 0;                  ///< 1-based, in the order of Tracker::update calls, none missing
  std::vector<TrackedBox> boxes;  ///< by id
  /// Merges of ids that were reported before this frame. With the default delay they are rare: a
  /// track usually gets its final id before its first box is reported.
  std::vector<IdMerge> merges;
};

}  // namespace sdmt::track
