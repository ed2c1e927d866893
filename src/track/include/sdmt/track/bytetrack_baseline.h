// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sdmt/mot/detection.h"
#include "sdmt/track/finished_frame.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

struct ByteTrackOptions {
  double track_threshold = 0.6;  ///< detections above are matched first; 0..1
  double birth_margin =
      0.1;  ///< above track_threshold, from which a detection starts a track; 0..1
  double low_threshold = 0.1;  ///< detections not above are ignored; 0..1
  bool fuse_scores = false;    ///< the first match weighs IoU by the detection's score
  int max_lost = 30;           ///< frames without a detection after which a track ends; >= 0
  /// ReportBox::filtered, as published, or ReportBox::detection, which smooth_tracks() wants.
  ReportBox report = ReportBox::filtered;

  /// Throws std::invalid_argument naming field, value and range.
  void validate() const;
};

/// ByteTrack (Zhang et al., "ByteTrack: Multi-object tracking by associating every detection box",
/// ECCV 2022) as a baseline beside SORT, with the rules and noise of its published implementation:
/// an eight-state Kalman filter on centre, aspect ratio and height, tracks and lost tracks matched
/// by IoU with strong detections first, what is left of the tracks with weak ones.
/// Scores must be probabilities.
class ByteTracker {
 public:
  explicit ByteTracker(const ByteTrackOptions& options = {});
  ~ByteTracker();
  ByteTracker(ByteTracker&&) noexcept;
  ByteTracker& operator=(ByteTracker&&) noexcept;

  /// Takes the detections of the next frame and returns its boxes. Boxes must be finite with an
  /// extent; throws std::invalid_argument otherwise.
  FinishedFrame update(std::span<const mot::Detection> detections);

 private:
  struct Track;
  struct Matching;

  Matching match(const std::vector<Track*>& tracks, const std::vector<mot::Detection>& detections,
                 double largest_cost, bool fuse) const;
  void drop_duplicates();

  ByteTrackOptions options_;
  int frame_ = 0;
  int last_id_ = 0;
  std::vector<std::unique_ptr<Track>> tracks_;  // by id
};

}  // namespace sdmt::track
