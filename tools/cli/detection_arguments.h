// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "sdmt/pipeline/detection_source.h"

namespace sdmt::tools {

/// Where boxes come from, as the command line describes it.
struct DetectionArguments {
  std::string detections;  ///< boxes that somebody else made, or "hog"
  std::string detector;    ///< "hog" or the file of a network
  pipeline::DetectorOptions options;
  mot::DetectionReading reading;
  std::string every;  ///< frames between two looks of the detector, or "auto"; empty: all frames

  /// Whether boxes are found in the frames, rather than brought along for numbered ones.
  bool look_at_frames() const {
    return !detector.empty() || detections.empty() || detections == "hog";
  }
  /// For the frames of `input`. Throws std::invalid_argument when both are given, and as
  /// pipeline::open_detector() and pipeline::open_detection_source().
  std::unique_ptr<pipeline::DetectionSource> open(const std::string& input) const;

 private:
  // The detector as `every` says.
  std::unique_ptr<pipeline::DetectionSource> sparse(
      std::unique_ptr<pipeline::DetectionSource> source, const std::string& input) const;
};

/// Adds --detector and what detectors are told.
void add_detector_arguments(CLI::App& command, DetectionArguments& arguments);
/// And --detections.
void add_detection_arguments(CLI::App& command, DetectionArguments& arguments);

}  // namespace sdmt::tools
