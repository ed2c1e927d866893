// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "sdmt/image/camera_motion.h"
#include "sdmt/track/finished_frame.h"
#include "sdmt/track/kalman_filter.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// How boxes become output, the same for all tracks of a tracker.
struct OutputRules {
  /// `lag`: frames between a frame and the decision about it. Throws std::invalid_argument where
  /// `amodal` is still OutputOptions::kInputSize.
  OutputRules(const OutputOptions& options, const MotionOptions& motion, int lag);

  ReportBox report;
  FillGaps fill;
  int max_fill;
  double score_noise;
  KalmanFilter smoother;

  /// How much noisier than a certain one a box of this score is.
  double looseness(double score) const {
    return 1 + score_noise * (1 - std::clamp(score, 0.0, 1.0));
  }
  /// Frames of a track smoothed at once: the backward pass is long, and the last of them still
  /// looks ahead seven eighths of the lag.
  int smoothing_block;
};

/// The boxes of a track that are not reported yet, and the last one before them. A smoothed box is
/// the Rauch-Tung-Striebel estimate from all boxes of the track up to the time it is asked for,
/// which is its frame plus the delay: the forward filter runs as boxes come, the backward pass over
/// the boxes held here when one is reported.
class TrackHistory {
 public:
  /// `rules` must outlive it.
  explicit TrackHistory(const OutputRules& rules) : rules_(&rules) {}

  /// `filtered`: the tracking filter's estimate after the box.
  void append(int frame, const mot::Cxcywh& measured, const mot::Cxcywh& filtered, double score,
              BoxSource source);
  /// Puts an older track's boxes before these, which must begin later; runs the smoother again
  /// over these.
  void prepend(const TrackHistory& older);

  /// The person at the first box that is not forgotten, as all boxes until now tell, and its frame.
  KalmanState start() const;
  int start_frame() const { return entries_[first_].frame; }
  /// The first of them, as it was measured.
  const mot::Cxcywh& first_box() const { return entries_[first_].measured; }
  /// The box where the person was last seen, as those before tell.
  mot::Cxcywh last_box() const { return entries_.back().forward.box(); }
  /// The box of `frame`, its id unset; nothing before the first and after the last box and in gaps
  /// that are not filled.
  std::optional<TrackedBox> at(int frame);
  /// The camera moved.
  void warp(const image::CameraMotion& motion);
  /// Frees what is not needed to answer for frames after `frame`.
  void forget(int frame);
  /// Gives the memory of what is forgotten back.
  void drop_forgotten();

 private:
  friend struct Snapshot;

  struct Entry {
    int frame;
    BoxSource source;
    bool merged;  // the gap before it lies between two merged tracklets
    double score;
    mot::Cxcywh measured;
    mot::Cxcywh filtered;
    KalmanState forward;
    SmootherGain gain;  // from the next entry, set when that comes
    std::optional<KalmanState> smoothed;
  };

  template <typename Visit>
  void smooth_back_to(std::size_t entry, Visit visit) const;
  const KalmanState& smoothed(std::size_t entry);
  TrackedBox interpolated(std::size_t before, int frame);

  const OutputRules* rules_;  // a pointer, so that histories can be assigned
  std::vector<Entry> entries_;
  std::size_t first_ = 0;  // entries before are forgotten, their memory not yet given back
};

}  // namespace sdmt::track
