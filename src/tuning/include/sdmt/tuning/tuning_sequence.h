// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/eval/benchmark.h"
#include "sdmt/eval/ground_truth.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/track/score_calibration.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::tuning {

/// A sequence to choose options on, with the detections of one detector.
struct TuningSequence {
  mot::Sequence sequence;
  eval::GroundTruth gt;
  eval::Benchmark benchmark = eval::Benchmark::mot15;  ///< mot16 where ground truth has classes
  std::string detector;                                ///< the name of the file in det/
  mot::DetectionFile detections;
  std::optional<track::ScoreCalibration> calibration;  ///< unless the options have one

  /// The options to track it with: `options`, the calibration where they have none, and the size of
  /// its picture where they ask for it. Throws std::invalid_argument where that is not stated.
  track::TrackerOptions adjusted(track::TrackerOptions options) const;
};

/// Reads sequences with ground truth, each named DIR, DIR=FILE or DIR=FILE@CALIBRATION. DIR: a
/// sequence folder or a folder of them, as eval::find_sequences() finds them. FILE: their
/// detections in det/, det.txt by default. CALIBRATION: as track::parse_calibration() reads it,
/// "none" by default. Throws std::invalid_argument for a sequence that is given twice with the same
/// FILE, and as the readers of these files do.
std::vector<TuningSequence> read_sequences(std::span<const std::string> names);

}  // namespace sdmt::tuning
