// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "sdmt/reid/auc_bootstrap.h"
#include "sdmt/reid/labelled_embeddings.h"
#include "sdmt/reid/roc.h"

namespace sdmt::reid {

/// Which pairs of images a curve is drawn from.
enum class PairSet {
  person_only,   ///< two images of persons
  cross_camera,  ///< two images of persons, taken by two cameras
  /// The paper's "equal mix of positive and negative pairs and distractors sampled from the
  /// background" (its section on the similarity metric): equally many pairs of one person, of two
  /// people, and of a person with the background (none when there is no background).
  paper,
};

struct PairCounts {
  std::int64_t positives = 0;    ///< one person
  std::int64_t negatives = 0;    ///< two people
  std::int64_t distractors = 0;  ///< a person and the background
};

/// How many pairs of the set the images have. For `paper`, before they are made equally many.
PairCounts count_pairs(const LabelledEmbeddings& images, PairSet set);

struct PairOptions {
  PairSet set = PairSet::person_only;
  /// 0: all pairs (for `paper` as many of each kind as the rarest has, up to kMaxSampledPairs).
  /// 1 to kMaxSampledPairs: at most so many of each kind. Samples are without replacement.
  std::int64_t pairs = 0;
  std::uint64_t seed = 1;

  static constexpr std::int64_t kMaxSampledPairs = 4'000'000;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// A curve, and what it was drawn from.
struct PairCurve {
  Roc roc;            ///< the negatives include the distractor pairs
  PairCounts counts;  ///< of the pairs used
  /// What the interval is drawn from: the pairs used or, when these are more than 8 million, all
  /// or 4 million of the positives and 4 million of the negatives, sampled.
  std::vector<ClusterPair> pairs;
  int identities = 0;  ///< clusters, as bootstrap_auc() takes them
  int backgrounds = 0;
};

/// How unlike the rows of two images are, 0 to 2; called by several threads.
using PairDistance = std::function<float(const float*, const float*)>;

/// Computes the distances of the set's pairs (Euclidean, of rows of length 1, unless `distance`
/// says otherwise). Exact up to 8 million pairs; beyond that distances are counted in bins of
/// 2^-19, which changes areas and rates by less than 1e-5 and keeps the memory under 200 MB however
/// many images there are. The same for any number of threads. Throws std::invalid_argument when the
/// images or options are not valid, or there is no pair of one person or none of two people.
PairCurve pair_curve(const LabelledEmbeddings& images, const PairOptions& options = {},
                     const PairDistance& distance = {});

/// Two images (by index) and how far apart they are.
struct ImagePair {
  int first = 0;
  int second = 0;
  float distance = 0;
};

/// The mistakes that cost most: the farthest pairs of one person, farthest first, and the nearest
/// pairs of two people, nearest first. At most one pair for each identity or pair of identities;
/// distractors take no part.
struct HardestPairs {
  std::vector<ImagePair> positives;
  std::vector<ImagePair> negatives;
};
HardestPairs hardest_pairs(const LabelledEmbeddings& images, std::size_t count);

}  // namespace sdmt::reid
