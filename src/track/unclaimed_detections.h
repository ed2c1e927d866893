// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <vector>

#include "frame_detections.h"
#include "sdmt/track/kalman_filter.h"
#include "sdmt/track/tracker_options.h"
#include "track_history.h"

namespace sdmt::track {

/// The detections of the last frames that no tracklet took and that started none. A tracklet that
/// has turned out to be a person looks back at them: a detector is unsure of people who come out
/// from behind something or in at the edge of the picture, so that their first boxes are weak.
class UnclaimedDetections {
 public:
  /// `filter`: the tracking filter.
  UnclaimedDetections(const TrackerOptions& options, const KalmanFilter& filter,
                      const OutputRules& rules);

  void begin_frame(int frame);
  /// Of the frame that began last.
  void add(const mot::Tlwh& box, double score) { frames_.back().boxes.push_back({box, score}); }

  /// The camera moved.
  void warp(const image::CameraMotion& motion);

  /// Follows a person who is at `start` in `frame` backwards, down to the frame after `decided` and
  /// over at most max_misses frames without a box, and takes the boxes met on the way out. The
  /// history of these; nullopt where there are none.
  std::optional<TrackHistory> claim(KalmanState start, int frame, int decided);

 private:
  friend struct Snapshot;

  struct Frame {
    int frame = 0;
    std::vector<mot::Detection> boxes;
  };

  const TrackerOptions& options_;
  const KalmanFilter& filter_;
  const OutputRules& rules_;
  std::deque<Frame> frames_;  // that a detector looked at
};

}  // namespace sdmt::track
