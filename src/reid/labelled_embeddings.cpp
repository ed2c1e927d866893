// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/labelled_embeddings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sdmt::reid {

void LabelledEmbeddings::validate() const {
  const auto rows = static_cast<std::size_t>(size());
  if (pids.size() != rows || camids.size() != rows) {
    throw std::invalid_argument("embeddings: " + std::to_string(rows) + " rows with " +
                                std::to_string(pids.size()) + " pids and " +
                                std::to_string(camids.size()) + " camids, expected one each a row");
  }
  for (int i = 0; i < size(); ++i) {
    const float* row = embeddings.image(i);
    if (std::all_of(row, row + dimensions(), [](float v) { return std::isfinite(v); })) continue;
    throw std::invalid_argument("embeddings: row " + std::to_string(i) +
                                " has a value that is not finite");
  }
}

void LabelledEmbeddings::validate_unit_rows() const {
  constexpr double kLongest = 1.001;
  for (int i = 0; i < size(); ++i) {
    double square = 0;
    for (int k = 0; k < dimensions(); ++k) {
      const double value = embeddings.image(i)[k];
      square += value * value;
    }
    if (square > kLongest * kLongest) {
      throw std::invalid_argument("embeddings: row " + std::to_string(i) + " has length " +
                                  std::to_string(std::sqrt(square)) + ", expected at most 1");
    }
  }
}

float squared_distance(const float* a, const float* b, int begin, int end) {
  // Sixteen sums side by side, so that the compiler can use vector registers without being allowed
  // to reorder.
  constexpr int kLanes = 16;
  std::array<float, kLanes> sums{};
  int k = begin;
  for (; k + kLanes <= end; k += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float difference = a[k + lane] - b[k + lane];
      sums[lane] += difference * difference;
    }
  }
  float total = 0;
  for (const float sum : sums) total += sum;
  for (; k < end; ++k) total += (a[k] - b[k]) * (a[k] - b[k]);
  return total;
}

float euclidean_distance(const float* a, const float* b, int size) {
  return std::sqrt(squared_distance(a, b, 0, size));
}

}  // namespace sdmt::reid
