// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "clear_pairs.h"
#include "detection_assignment.h"
#include "detection_boosting.h"
#include "embedding_selection.h"
#include "frame_clock.h"
#include "frame_detections.h"
#include "scene_calibration.h"
#include "sdmt/track/tracker.h"
#include "track_output.h"
#include "tracklet.h"
#include "tracklet_association.h"
#include "unclaimed_detections.h"

namespace sdmt::track {

/// Everything that a tracker is, and the steps of a frame in order.
struct Tracker::State {
  State(const TrackerOptions& given, image::CropDescriptor* model);

  void require_open() const {
    if (ended) throw std::logic_error("Tracker: finish() was called, nothing can follow it");
  }
  void accept(std::span<const mot::Detection> given);
  void pass(int frames);
  void predict(const image::CameraMotion& camera);
  void take_back();
  void embed(const image::ImageView* image);
  void assign();
  void boost(const image::ImageView* image);
  void update_tracklets();
  void associate();
  const std::vector<FinishedFrame>& complete(std::optional<double> time);
  void emit(bool at_end);

  void warp_but_active(const image::CameraMotion& camera);
  void look_back();
  void start_tracklet(std::size_t detection);
  void store_appearance(Tracklet& tracklet, std::size_t detection);
  void retire();
  void end_all();
  void announce_end(const Tracklet& tracklet) const;
  void give_up(const Tracklet& tracklet);
  void merge(Tracklet& older, Tracklet& newer);

  const TrackerOptions options;
  image::CropDescriptor* const descriptor;
  const double tau_a;
  const KalmanFilter motion;
  DetectionFilter filter;
  SceneCalibration scene;
  ClearPairs clear;  // of the frame's detections
  DetectionAssignment assignment;
  EmbeddingSelection selection;
  DetectionBoosting boosting;
  TrackletAssociation association;
  TrackOutput output;
  UnclaimedDetections unclaimed;

  std::function<void(const EndedTrack&)> track_ended;
  std::function<void(const DroppedTracklet&)> tracklet_dropped;

  bool ended = false;
  int frame = 0;  // of the options' rate: what clock makes of the time, else the number of calls
  FrameClock clock;
  int associated = 0;  // intervals until the last association
  int looked = 0;      // the last frame that a detector looked at
  int evidence = 1;    // frames that a detection of this one speaks for
  int last_id = 0;
  int dimension = 0;  // of the vectors that the descriptor gives, 0 before the first
  Tracklets active;   // by id
  Tracklets idle;     // inactive ones that can still be associated or reported, by id
  FrameDetections detections;
  std::vector<Match> matches;
  std::vector<image::Crop> crops;
  image::DescriptorRows rows;
  TrackerStats stats;
  // As they were before the frame, for take_back().
  TrackerStats stats_before;
  std::vector<KalmanState> states_before;  // [active]
};

}  // namespace sdmt::track
