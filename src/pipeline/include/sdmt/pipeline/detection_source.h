// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/mot/detection.h"
#include "sdmt/mot/detection_formats.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/hog_options.h"
#include "sdmt/pipeline/network_options.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::pipeline {

/// The smallest and the largest score.
struct ScoreRange {
  double low = 0;
  double high = 0;
};

/// Where the boxes of a frame come from.
class DetectionSource {
 public:
  virtual ~DetectionSource() = default;

  /// Boxes of one frame, the first pixel counted as 1. Called for every frame in order.
  virtual std::vector<mot::Detection> detect(const Frame& frame) = 0;
  /// The last frame there may be detections for; 0 when not limited.
  virtual int last_frame() const { return 0; }
  /// Whether it looks at the frames.
  virtual bool needs_images() const { return false; }
  /// The file that the boxes come from; empty for a detector.
  virtual std::filesystem::path file() const { return {}; }
  /// What makes its boxes unlikely to belong to a picture of `width` x `height` pixels (0: not
  /// known), as mot::describe_implausible(); empty when nothing does.
  virtual std::string implausibility(int /*width*/, int /*height*/) const { return {}; }
  /// The scores that it will give; nullopt when they are probabilities, or there are none.
  virtual std::optional<ScoreRange> score_range() const { return std::nullopt; }
  /// What tells people apart by the vectors that came with the boxes of the frame detected last;
  /// nullptr where none come.
  virtual image::CropDescriptor* descriptor() { return nullptr; }
  /// Whether it looked at the frame detected last. Where not, that there are no boxes says nothing.
  virtual bool looked() const { return true; }
  /// The time of the frame detected last, seconds, where boxes come with times.
  virtual std::optional<double> time() const { return std::nullopt; }
  /// Whether boxes that come live have come to their end.
  virtual bool ended() const { return false; }
};

/// What a detector of either kind is told.
struct DetectorOptions {
  HogOptions hog;
  NetworkOptions network;  ///< but for its file
};

/// `detector` is "hog" (HogDetector) or the file of a network (NetworkDetector). Throws as these.
std::unique_ptr<DetectionSource> open_detector(const std::string& detector,
                                               const DetectorOptions& options = {});

/// `spec` is "hog" (HogDetector), "-" (LiveDetections from standard input), or a file or folder of
/// boxes (mot::read_detections()). Throws std::invalid_argument as these.
std::unique_ptr<DetectionSource> open_detection_source(const std::string& spec,
                                                       const HogOptions& hog = {},
                                                       const mot::DetectionReading& reading = {});

/// What open_detection_source() takes where nobody said otherwise: the det/det.txt of a MOT
/// sequence that has one, else "hog".
std::string default_detections(const std::string& input);

/// Changes the options of the tracker that do not fit the scores: equal scores say nothing, and a
/// detector's probabilities need no calibration. Returns what was changed, and what else is odd
/// about the scores, in one line each.
std::vector<std::string> fit_to_scores(track::TrackerOptions& options,
                                       const DetectionSource& detections);

}  // namespace sdmt::pipeline
