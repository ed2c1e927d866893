// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/track/tracker.h"

namespace sdmt::pipeline {

/// What one run over an input did. Milliseconds and rates leave out decoding, detecting and
/// drawing.
struct RunReport {
  track::TrackerStats stats;
  int unreadable = 0;        ///< frames without an image where there should have been one
  double total_seconds = 0;  ///< of wall time, everything included

  /// Seconds inside the tracker.
  double tracker_seconds() const;
  double hz() const;
  double hz_without_embedding() const;
};

/// What a run tells its caller; each may be empty.
struct RunObservers {
  std::function<void(const Frame&)> read;                     ///< a frame before it is tracked
  std::function<void(const track::FinishedFrame&)> finished;  ///< in order
  std::function<void(const std::string&)> warning;            ///< one line of text
  std::function<bool()> stop;                                 ///< true: end as at the last frame
};

/// Tracks an input from its first to its last frame.
/// `images`: whether the tracker or the detector look at frames; without, nothing is decoded.
/// Frames that cannot be read are tracked by motion on the detections they have, and counted.
/// Throws std::invalid_argument when not one of the frames could be read, and what the parts throw.
RunReport run_sequence(FrameSource& frames, DetectionSource& detections, track::Tracker& tracker,
                       bool images, const RunObservers& observers);

/// An 8-bit BGR matrix as nn and track take images; it does not own the pixels.
image::ImageView image_view(const cv::Mat& image);

}  // namespace sdmt::pipeline
