// SPDX-License-Identifier: Apache-2.0
#include "kernels/column_sum.h"

#include <algorithm>
#include <vector>

namespace sdmt::nn {

void add_column_sums(const float* values, std::int64_t rows, std::int64_t columns, float* sum) {
  constexpr std::int64_t kRowsPerPart = 512;  // short sums lose little; parts run in parallel
  const std::int64_t parts = (rows + kRowsPerPart - 1) / kRowsPerPart;
  std::vector<float> partial(parts * columns, 0.0F);
  // nothing throws
#pragma omp parallel for schedule(static)
  for (std::int64_t part = 0; part < parts; ++part) {
    float* const to = partial.data() + part * columns;
    const std::int64_t end = std::min(rows, (part + 1) * kRowsPerPart);
    for (std::int64_t row = part * kRowsPerPart; row < end; ++row) {
      const float* from = values + row * columns;
      for (std::int64_t j = 0; j < columns; ++j) to[j] += from[j];
    }
  }
  for (std::int64_t j = 0; j < columns; ++j) {
    double total = 0.0;
    for (std::int64_t part = 0; part < parts; ++part) {
      total += partial[part * columns + j];
    }
    sum[j] += static_cast<float>(total);
  }
}

}  // namespace sdmt::nn
