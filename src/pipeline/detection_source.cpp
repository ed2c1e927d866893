// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/detection_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <iostream>
#include <limits>

#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/file_detections.h"
#include "sdmt/pipeline/hog_detector.h"
#include "sdmt/pipeline/live_detections.h"
#include "sdmt/pipeline/network_detector.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

std::optional<ScoreRange> FileDetections::score_range() const {
  if (file_.size() == 0) return std::nullopt;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ScoreRange range{kInfinity, -kInfinity};
  for (const mot::Detection& detection : file_.detections()) {
    range.low = std::min(range.low, detection.score);
    range.high = std::max(range.high, detection.score);
  }
  return range;
}

std::unique_ptr<DetectionSource> open_detection_source(const std::string& spec,
                                                       const HogOptions& hog,
                                                       const mot::DetectionReading& reading) {
  if (spec == "hog") return std::make_unique<HogDetector>(hog);
  if (spec == "-") return std::make_unique<LiveDetections>(std::cin, "standard input", reading);
  return std::make_unique<FileDetections>(mot::read_detections(spec, reading), spec);
}

std::unique_ptr<DetectionSource> open_detector(const std::string& detector,
                                               const DetectorOptions& options) {
  if (detector == "hog") return std::make_unique<HogDetector>(options.hog);
  NetworkOptions network = options.network;
  network.file = detector;
  return std::make_unique<NetworkDetector>(network);
}

std::string default_detections(const std::string& input) {
  if (!mot::Sequence::is_sequence(input)) return "hog";
  const auto file = mot::Sequence::read(input).detections();
  return fs::exists(file) ? file.string() : "hog";
}

std::vector<std::string> fit_to_scores(track::TrackerOptions& options,
                                       const DetectionSource& detections) {
  std::vector<std::string> notes;
  const auto range = detections.score_range();
  if (!range && detections.file().empty() && options.input.calibration) {
    notes.emplace_back("--calibration is not used: the detector gives probabilities");
    options.input.calibration.reset();
  }
  if (!range || !options.input.use_scores) return notes;
  const std::string file = detections.file().string();
  if (range->low == range->high) {
    options.input.use_scores = false;
    notes.push_back(file + ": all scores are equal, every detection is taken as certain");
  } else if (!options.input.calibration && (range->low < 0 || range->high > 1)) {
    notes.push_back(
        fmt::format("{}: scores from {:.4g} to {:.4g} are no probabilities; thresholds may not "
                    "fit them, see --calibration",
                    file, range->low, range->high));
  }
  return notes;
}

}  // namespace sdmt::pipeline
