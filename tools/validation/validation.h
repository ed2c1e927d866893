// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
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
  /// Also scores all rows that are compared by Euclidean distance after
  /// reid::subtract_camera_means(), as contenders of their own.
  bool centre = false;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// A curve with the intervals of its area and of what the thresholds do.
struct ValidatedCurve {
  reid::PairCurve pairs;
  reid::CurveIntervals intervals;  ///< 95 %
};

/// What one contender reaches.
struct ContenderScores {
  std::string name;
  ValidatedCurve person_only;
  std::optional<ValidatedCurve> cross_camera;  ///< where both kinds of pairs exist
  ValidatedCurve paper;
  /// Of Euclidean distances, where a query has anything to find.
  std::optional<reid::ReidMetrics> search;
  std::optional<double> stored_tau_a;  ///< that the contender came with
};

/// A threshold and what it does on the person-only pairs.
struct ThresholdChoice {
  std::string criterion;
  double tau_a = 0;
  double tpr = 0;
  double fpr = 0;
};

/// By a criterion of ValidationOptions. Throws std::invalid_argument for another.
ThresholdChoice choose_threshold(const reid::Roc& roc, const std::string& criterion,
                                 double target_fpr);

struct ValidationScores {
  std::string data;  ///< name of the folder
  int images = 0;
  int people = 0;
  int cameras = 0;
  int distractors = 0;  ///< images
  int unreadable = 0;   ///< images
  ValidationOptions options;
  /// The model's first, then the others, then all of these centred where that was asked for.
  std::vector<ContenderScores> contenders;
  std::vector<ThresholdChoice> thresholds;
  ThresholdChoice chosen;  ///< by options.criterion
};

/// Steps of score() for each contender, centred ones included.
inline constexpr int kScoringSteps = 4;

/// Scores every contender; the thresholds are the first's. `progress` gets the steps done. Throws
/// as reid::pair_curve().
ValidationScores score(const DescribedCrops& described, std::span<const Contender> contenders,
                       const ValidationOptions& options, const std::string& data,
                       const std::function<void(std::int64_t)>& progress);

/// One data set in full; several, one below the other in two tables.
std::string to_text(std::span<const ValidationScores> sets);
/// The object of one data set; several as {"sets": [...]}.
nlohmann::ordered_json to_json(std::span<const ValidationScores> sets);

// Cells of the tables in the text and the report.
std::string format_rate(double value);                 ///< "0.9731"
std::string format_area(const ValidatedCurve& curve);  ///< "0.9731 [0.9650, 0.9803]"
std::string format_interval(double value, const reid::Interval& interval);  ///< likewise
/// What the thresholds do: header and a contender's cells. TPR and FPR at the stored tau_a, and the
/// tau_a that the wanted FPR needs.
std::vector<std::string> rates_header(const ValidationOptions& options);
std::vector<std::string> rates_cells(const ContenderScores& contender,
                                     const ValidationOptions& options);
std::string format_count(std::int64_t value);  ///< "497,174"
/// Of the person-only and paper sets: how many pairs of each kind.
std::string describe_pairs(const reid::PairCounts& counts);
/// "1,002 images of 104 people by 2 cameras".
std::string describe_images(const ValidationScores& scores);

}  // namespace sdmt::tools
