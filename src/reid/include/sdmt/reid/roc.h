// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace sdmt::reid {

/// How many pairs of the same person (positives) and of two people (negatives) lie at a distance.
struct DistanceCount {
  double distance = 0;
  std::int64_t positives = 0;
  std::int64_t negatives = 0;
};

/// One threshold of the curve: pairs with distance <= threshold are called the same person.
struct RocPoint {
  double threshold = 0;
  double tpr = 0;  ///< share of the positives called the same
  double fpr = 0;  ///< share of the negatives called the same
};

/// The receiver operating characteristic of a distance as a test for "the same person", from all
/// the counts: pairs at equal distance fall on one side together, so the order of input never
/// matters. Both classes count equally whatever their sizes.
class Roc {
 public:
  /// Exact; distances are finite and >= 0. Throws std::invalid_argument when a class is empty or a
  /// distance is not finite.
  Roc(std::span<const float> positives, std::span<const float> negatives);
  /// The same from counts at ascending distances, such as a fine histogram. Throws as above, and
  /// when the distances do not ascend.
  explicit Roc(std::vector<DistanceCount> counts);

  std::int64_t positives() const { return positives_; }
  std::int64_t negatives() const { return negatives_; }

  /// Area under the curve: the probability that a positive is nearer than a negative, ties one half
  /// (Mann-Whitney's U divided by positives * negatives).
  double auc() const;
  /// Equal error rate: where the curve, linear between its points, has fpr == 1 - tpr.
  double eer() const;
  /// Height of the curve, linear between its points, at `fpr` in [0, 1].
  double tpr_at_fpr(double fpr) const;
  /// The other way round: where the curve, linear between its points, reaches `tpr` in [0, 1].
  double fpr_at_tpr(double tpr) const;
  /// Largest share of right answers when both classes are equally frequent: max (tpr + 1 - fpr)
  /// / 2.
  double accuracy() const;

  // Thresholds for the tracker's affinity 1 - d (section "Appearance affinity" of the paper): a
  // pair is the same person when 1 - d > tau_a. Each lies midway between two neighbouring
  // distances.
  /// Of the largest accuracy(), at the smallest such distance. The default of `sdmt validate-roc`.
  double tau_a_max_accuracy() const;
  /// Of the point nearest to the equal error rate.
  double tau_a_eer() const;
  /// The most permissive that keeps the false positives at or under `fpr` in [0, 1].
  double tau_a_at_fpr(double fpr) const;
  /// Where, going up from the positives' median, the two distance histograms (100 bins from zero to
  /// the largest distance, equal mass) cross.
  double tau_a_histogram_crossing() const;

  /// Rates when pairs at `distance` and nearer are called the same person.
  RocPoint at(double distance) const;
  /// From (0, 0), with a threshold below all distances, to (1, 1); tpr and fpr ascend.
  std::vector<RocPoint> points() const;
  const std::vector<DistanceCount>& counts() const { return counts_; }

 private:
  double threshold_after(std::size_t i) const;
  double tpr(std::size_t i) const;
  double fpr(std::size_t i) const;

  std::vector<DistanceCount> counts_;         // one row for each distance that occurs
  std::vector<std::int64_t> positives_upto_;  // [i]: sum over the first i rows
  std::vector<std::int64_t> negatives_upto_;
  std::int64_t positives_ = 0;
  std::int64_t negatives_ = 0;
};

/// The distances of both classes as densities of equal mass (each sums to 1) over `bins` >= 1 equal
/// bins from zero to the largest distance.
struct DistanceHistogram {
  double bin_width = 0;
  std::vector<double> positives;
  std::vector<double> negatives;
};
DistanceHistogram distance_histogram(const Roc& roc, int bins);

}  // namespace sdmt::reid
