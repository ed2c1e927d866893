// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/reid/pair_curve.h"
#include "sdmt/reid/reid_metrics.h"
#include "validation/described_crops.h"

namespace sdmt::tools {

struct ValidationOptions {
  std::int64_t pairs = 0;  ///< as reid::PairOptions
  std::uint64_t seed = 1;  ///< of samples of pairs and of the bootstrap
  /// How tau_a is chosen: "accuracy" (largest, on equally many pairs of one and of two people),
  /// "eer", "crossing" (of the distance histograms) or "fpr" (at most target_fpr).
  std::string criterion = "accuracy";
  double target_fpr = 0.01;  ///< in (0, 1)

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// A curve with the interval of its area.
struct ValidatedCurve {
  reid::PairCurve pairs;
  reid::AucInterval interval;  ///< 95 %
};

/// What one contender reaches.
struct ContenderScores {
  std::string name;
  ValidatedCurve person_only;
  std::optional<ValidatedCurve> cross_camera;  ///< where both kinds of pairs exist
  ValidatedCurve paper;
  /// Of Euclidean distances, where a query has anything to find.
  std::optional<reid::ReidMetrics> search;
};

/// A threshold and what it does on the person-only pairs.
struct ThresholdChoice {
  std::string criterion;
  double tau_a = 0;
  double tpr = 0;
  double fpr = 0;
};

struct ValidationScores {
  std::string data;  ///< name of the folder
  int images = 0;
  int people = 0;
  int cameras = 0;
  int distractors = 0;  ///< images
  int unreadable = 0;   ///< images
  ValidationOptions options;
  std::vector<ContenderScores> contenders;  ///< the model's first, then the baselines
  std::vector<ThresholdChoice> thresholds;
  ThresholdChoice chosen;  ///< by options.criterion
};

/// Scores every contender; the thresholds are the first's. Throws as
/// reid::pair_curve().
ValidationScores score(const DescribedCrops& described, std::span<const Contender> contenders,
                       const ValidationOptions& options, const std::string& data);

std::string to_text(const ValidationScores& scores);
nlohmann::ordered_json to_json(const ValidationScores& scores);

// Cells of the tables in the text and the report.
std::string format_rate(double value);                 ///< "0.9731"
std::string format_area(const ValidatedCurve& curve);  ///< "0.9731 [0.9650, 0.9803]"
std::string format_count(std::int64_t value);          ///< "497,174"
/// Of the person-only and paper sets: how many pairs of each kind.
std::string describe_pairs(const reid::PairCounts& counts);
/// "1,002 images of 104 people by 2 cameras".
std::string describe_images(const ValidationScores& scores);

}  // namespace sdmt::tools
