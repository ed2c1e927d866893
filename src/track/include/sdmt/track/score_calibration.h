// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

namespace sdmt::track {

/// Maps a detector's raw score s to the probability that its box fits a person (IoU >= 0.5):
/// p = 1 / (1 + exp(-(s - midpoint) / scale)). Thresholds on scores mean nothing across detectors
/// without it: the public DPM and ACF detections come with raw margins.
struct ScoreCalibration {
  double midpoint = 0;  ///< the score with probability 1/2
  double scale = 1;     ///< > 0, in units of the score

  double probability(double score) const;
  /// Throws std::invalid_argument naming the field when a value is not finite or scale <= 0.
  void validate() const;

  bool operator==(const ScoreCalibration&) const = default;
};

/// "none" (no mapping), a preset by detector, or "MIDPOINT,SCALE". The presets were fitted on
/// public training sequences to "IoU >= 0.5 with a ground-truth box":
///   frcnn      Faster R-CNN detections published with SORT        0.81, 0.11
///   acf        public ACF detections of MOT15                     20.5, 22.1
///   synthetic  det-synthetic.txt, margins like the public DPM's   0.26, 0.52
/// Throws std::invalid_argument for anything else, listing what is known.
std::optional<ScoreCalibration> parse_calibration(std::string_view text);

}  // namespace sdmt::track
