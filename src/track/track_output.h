// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "sdmt/track/finished_frame.h"
#include "sdmt/track/tracker_options.h"
#include "track_history.h"
#include "tracklet.h"

namespace sdmt::track {

/// Fixed-lag output. What is said about frame f is decided when frame f + lag has been seen, lag
/// being the delay or auto_delay(), whichever is less: whether a tracklet is positive (once
/// reported it stays so), its id, and its box, smoothed and filled in from what is known then.
/// Longer delays hold back finished frames and change nothing in them, which is why any delay from
/// `auto` on gives the same output, and why that of a file is that of a stream.
class TrackOutput {
 public:
  /// `lag`: TrackerOptions::decision_lag().
  TrackOutput(const OutputOptions& options, const MotionOptions& motion,
              const ConfidenceOptions& confidence, int lag);

  const OutputRules& rules() const { return rules_; }

  /// The next frame that is to be reported; numbers rise, and may leave some out.
  void add(int frame) { waiting_.push_back({frame, {}}); }
  /// The camera moved: what waits is to be reported where it was.
  void warp(const image::CameraMotion& motion);
  /// Says so in the output where `newer`, about to become one with `older`, was reported already.
  void announce_merge(const Tracklet& older, const Tracklet& newer);
  int decided() const { return decided_; }  ///< the last frame decided about

  /// Decides about every frame that is due at `frame`, all that are left when at_end, and makes
  /// those whose delay is over the new finished(). Counts new ids in `tracks`.
  void emit(int frame, bool at_end, Tracklets& active, Tracklets& idle, std::int64_t& tracks);
  const std::vector<FinishedFrame>& finished() const { return finished_; }

 private:
  friend struct Snapshot;

  struct Waiting {
    int frame;
    image::CameraMotion back;  // from the present picture to that of the frame
  };
  void decide(const Waiting& waiting, Tracklets& tracklets, std::vector<TrackedBox>& boxes,
              std::int64_t& tracks);

  const OutputOptions& options_;
  const ConfidenceOptions& confidence_;
  OutputRules rules_;
  int lag_;
  int decided_ = 0;
  struct Held {
    int frame;  // as add() was told
    FinishedFrame finished;
  };
  int reported_ = 0;             // frames until now
  std::deque<Waiting> waiting_;  // to be decided about
  std::vector<IdMerge> merges_;  // since the last one decided
  std::deque<Held> held_;
  std::vector<FinishedFrame> finished_;
};

}  // namespace sdmt::track
