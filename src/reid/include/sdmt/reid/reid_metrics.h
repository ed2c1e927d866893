// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sdmt/reid/labelled_embeddings.h"

namespace sdmt::reid {

/// What a search for each query in the gallery finds, by the protocol of Market-1501 (Zheng et al.,
/// ICCV 2015; single query): the gallery is sorted by distance (at equal distance in its own
/// order); images of the query's person by the query's camera are passed over; distractors count as
/// wrong.
struct ReidMetrics {
  /// Share of queries with a right image among the first k results.
  double rank1 = 0;
  double rank5 = 0;
  double rank10 = 0;
  /// Mean average precision, precision taken at each right image (open-reid, scikit-learn, VOC
  /// 2010).
  double map = 0;
  /// The same by trapezoids between the points of the precision-recall curve, as the evaluation
  /// code published with Market-1501 (after Oxford Buildings) computes it; usually a little lower.
  double map_trapezoid = 0;
  std::int64_t queries = 0;  ///< that have a right image in the gallery; the others are left out
  std::int64_t queries_without_match = 0;
};

/// Throws std::invalid_argument when a set is not valid, a query is a distractor, or the dimensions
/// differ. Nothing when no query has a right image (all by one camera, say).
std::optional<ReidMetrics> reid_metrics(const LabelledEmbeddings& queries,
                                        const LabelledEmbeddings& gallery);

/// Average precisions of one ranking: right[r] says whether result r is right. Both 0 when none is.
struct AveragePrecision {
  double at_hits = 0;
  double trapezoid = 0;
};
AveragePrecision average_precision(const std::vector<bool>& right);

}  // namespace sdmt::reid
