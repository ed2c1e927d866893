// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <functional>
#include <optional>
#include <string>

#include "sdmt/image/camera_motion.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/run_state.h"
#include "sdmt/pipeline/unreadable_frames.h"
#include "sdmt/track/tracker.h"

namespace sdmt::pipeline {

/// What one run over an input did. Milliseconds and rates leave out decoding, detecting and
/// drawing.
struct RunReport {
  track::TrackerStats stats;
  track::SceneReport scene;
  int unreadable = 0;        ///< frames without an image where one was wanted
  bool ended_early = false;  ///< the input ended by itself, clearly before the frames it announced
  /// What the source of detections threw: the input ends there as at its last frame, and what
  /// came before is finished. nullptr when nothing did.
  std::exception_ptr failure;
  /// Boxes that came live ended, and frames without an end with them.
  bool boxes_ended = false;
  int camera_lost = 0;             ///< frames in which the motion of the camera could not be found
  std::optional<LiveCounts> live;  ///< of a camera or stream
  double detect_seconds = 0;       ///< in the source of detections
  double total_seconds = 0;        ///< of wall time, everything included

  /// Seconds inside the tracker.
  double tracker_seconds() const;
  double hz() const;
  double hz_without_embedding() const;
};

/// What a run tells its caller; each may be empty.
struct RunObservers {
  std::function<void(const Frame&)> read;  ///< a frame before it is tracked
  /// In order, with the time of the frame.
  std::function<void(const track::FinishedFrame&, const FrameTime&)> finished;
  std::function<void(const std::string&)> warning;  ///< one line of text
  std::function<bool()> stop;                       ///< true: end as at the last frame
  std::function<void(const RunReport&)> progress;   ///< after each frame: what was done so far
  UnreadableFrames* unreadable = nullptr;  ///< counts them with others; then it warns of them
  /// Keeps what a killed run can go on from. A run that goes on hands over all finished frames from
  /// the first one, and passes over the frames of a repeatable input that it had seen.
  RunState* state = nullptr;
  /// Finds how the camera moved, on the frames' images; nullptr: it stands still.
  image::CameraMotionEstimator* camera = nullptr;
  /// What it found for a frame; nothing: it could not.
  std::function<void(int frame, const std::optional<image::CameraMotion>&)> camera_moved;
};

/// Tracks an input from its first to its last frame.
/// `images`: whether the tracker or an observer look at frames; where the detector does not either,
/// nothing is decoded. Frames that cannot be read are tracked by motion on the detections they
/// have, and counted. Throws std::invalid_argument when not one of the frames could be read, and
/// what the other parts throw.
RunReport run_sequence(FrameSource& frames, DetectionSource& detections, track::Tracker& tracker,
                       bool images, const RunObservers& observers);

/// TrackerOptions::fit_to_picture() of an input, whose size is looked for only where it is wanted.
void fit_to_picture(track::TrackerOptions& options, const FrameSource& frames,
                    const std::string& input);

}  // namespace sdmt::pipeline
