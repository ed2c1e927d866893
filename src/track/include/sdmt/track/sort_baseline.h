// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sdmt/mot/detection.h"
#include "sdmt/track/finished_frame.h"

namespace sdmt::track {

struct SortOptions {
  int max_age = 1;             ///< predictions without a detection after which a track ends; >= 0
  int min_hits = 3;            ///< detections in a row before a track is reported; >= 0
  double iou_threshold = 0.3;  ///< smallest IoU of an assignment, 0..1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// SORT (Bewley et al., "Simple online and realtime tracking", ICIP 2016) as the baseline beside
/// this project's tracker, with the rules and noise of its published implementation, so that it
/// gives the same numbers: a seven-state Kalman filter on centre, area and aspect ratio, IoU
/// assignment, no memory beyond max_age, scores ignored.
class SortTracker {
 public:
  explicit SortTracker(const SortOptions& options = {});
  ~SortTracker();
  SortTracker(SortTracker&&) noexcept;
  SortTracker& operator=(SortTracker&&) noexcept;

  /// Takes the detections of the next frame and returns its boxes. Boxes must be finite with an
  /// extent; throws std::invalid_argument otherwise.
  FinishedFrame update(std::span<const mot::Detection> detections);

 private:
  struct Track;

  SortOptions options_;
  int frame_ = 0;
  int last_id_ = 0;
  std::vector<Track> tracks_;
};

}  // namespace sdmt::track
