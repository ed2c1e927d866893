// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/tensor.h"

namespace sdmt::reid {

/// Images as points, mostly of the unit sphere: row i of `embeddings` {n,1,1,d} belongs to pids[i]
/// and camids[i]. pid kDistractorPid (market1501.h) marks background, which is nobody's image.
struct LabelledEmbeddings {
  nn::Tensor embeddings;
  std::vector<int> pids;
  std::vector<int> camids;

  int size() const { return embeddings.shape().n; }
  int dimensions() const { return static_cast<int>(embeddings.shape().image_size()); }

  /// Throws std::invalid_argument when there are not as many pids and camids as rows, or a value is
  /// not finite.
  void validate() const;
  /// Throws std::invalid_argument naming the first row that is longer than 1 by more than rounding.
  void validate_unit_rows() const;
};

/// Euclidean distance of two vectors of `size` values, summed in an order that depends on nothing
/// else.
float euclidean_distance(const float* a, const float* b, int size);

/// The part of its square that values [begin, end) of the vectors contribute.
float squared_distance(const float* a, const float* b, int begin, int end);

}  // namespace sdmt::reid
