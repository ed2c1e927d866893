// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/mot/box.h"
#include "sdmt/mot/detection.h"
#include "sdmt/mot/overlaps.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// The detections of one frame as the tracker sees them; a box keeps its index until the next
/// frame. Boosted boxes come after those of the detector.
struct FrameDetections {
  struct Flags {
    bool strong = false;    ///< may be matched by appearance and start a tracklet
    bool boosted = false;   ///< found by appearance, not by the detector
    bool dropped = false;   ///< by boosting, because it overlaps a better box: not to be used
    bool embedded = false;  ///< has a feature vector
  };

  std::vector<mot::Tlwh> boxes;
  std::vector<double> scores;  ///< calibrated
  std::vector<Flags> flags;
  int dimension = 0;
  std::vector<float> features;  ///< [boxes, dimension], set where `embedded`

  std::size_t size() const { return boxes.size(); }
  std::span<const float> feature(std::size_t i) const {
    const auto length = static_cast<std::size_t>(dimension);
    return std::span(features).subspan(i * length, length);
  }

  void clear();
  void add(const mot::Tlwh& box, double score, const Flags& flag);
  void set_feature(std::size_t i, std::span<const float> feature);
};

/// The door of the tracker: checks detections, calibrates their scores, drops those below
/// min_confidence and duplicates. Keeps its memory.
class DetectionFilter {
 public:
  /// Throws std::invalid_argument as Tracker::update, before `accepted` is changed.
  void accept(std::span<const mot::Detection> detections, const InputOptions& options,
              FrameDetections& accepted);

 private:
  mot::OverlapFinder overlaps_;
  std::vector<mot::Tlwh> boxes_;
  std::vector<double> scores_;
  std::vector<std::uint8_t> keep_;
};

}  // namespace sdmt::track
