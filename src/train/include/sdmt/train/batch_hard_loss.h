// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>

#include "sdmt/io/range.h"

namespace sdmt::train {

enum class LossKind {
  /// The paper's loss (section III-A; Hadsell, Chopra & LeCun, CVPR 2006) over the hardest pairs of
  /// each anchor: 1/2 d^2 for the farthest image of the same person, 1/2 max(0, margin - d)^2 for
  /// the nearest image of another. Mean over the 2 B pairs of B anchors.
  contrastive,
  /// Batch-hard triplets with soft margin (Hermans, Beyer & Leibe, 2017): mean over the anchors of
  /// log(1 + exp(s (d_p - d_n))) / s, s = triplet_scale. Ranks as well as the contrastive loss, but
  /// fixes no distance at which people differ, which the tracker's affinity 1 - d needs.
  triplet
};

struct BatchHardOptions {
  static constexpr io::Range kMargin{.low = 0, .high = 2, .above = true};
  static constexpr io::Range kTripletScale{
      .low = 0, .high = std::numeric_limits<double>::infinity(), .above = true, .below = true};

  LossKind kind = LossKind::contrastive;
  double margin = 0.2;         ///< contrastive: different people are pushed this far apart, (0, 2]
  double triplet_scale = 8.0;  ///< s above, > 0; PyTorch's soft margin is 1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// What the mining found; tells a training that works from one that has collapsed.
struct MiningStatistics {
  double mean_distance = 0;     ///< over all pairs of the batch
  double hardest_positive = 0;  ///< mean over the anchors of the farthest same-person distance
  double hardest_negative = 0;  ///< mean over the anchors of the nearest other-person distance
  /// Share of anchors whose nearest negative still has a gradient: contrastive, closer than the
  /// margin; triplet, closer than the farthest positive.
  double active_negatives = 0;
  /// Root mean square distance of the embeddings to their mean; 0: all are the same point.
  double spread = 0;
};

struct BatchHardResult {
  double loss = 0;
  MiningStatistics mining;
};

/// Whether two labels are known to belong to two people.
using Strangers = std::function<bool(int, int)>;

/// Loss of a batch of embeddings and its gradient.
///
/// `embeddings` is [n, dim] row by row; `labels` says who is on each image, `samples` which image
/// it is: an image drawn twice is not its own positive. An anchor without a positive (or negative)
/// partner skips that term, which still counts in the mean. Among equally hard partners the first
/// row wins. Distances are sqrt(d^2 + 1e-12), so that the gradient exists at 0. `gradient`, [n,
/// dim], is overwritten with dL/d(embeddings). With `strangers`, only images of labels that it
/// holds to be two people are negatives of one another; it is symmetric. Without, all different
/// labels. T is float or double. Throws std::invalid_argument when the sizes do not fit together.
template <typename T>
BatchHardResult batch_hard_loss(std::span<const T> embeddings, std::span<const int> labels,
                                std::span<const int> samples, const BatchHardOptions& options,
                                std::span<T> gradient, const Strangers& strangers = {});

/// Watches the mining of a training and tells, once each, when it cannot be learning.
class CollapseMonitor {
 public:
  /// Takes the statistics of one iteration. Returns a sentence when for 50 iterations in a row no
  /// negative was active while positives are as far apart as different people ("only the pull
  /// acts"), or all embeddings lay in one point; an empty string otherwise.
  std::string add(const MiningStatistics& mining);

 private:
  int inactive_ = 0;
  int collapsed_ = 0;
};

}  // namespace sdmt::train
