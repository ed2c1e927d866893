// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace sdmt::nn {

/// Adds the sum of every column of a dense [rows, columns] matrix to sum[0..columns). The order of
/// summation is fixed by the shape alone.
void add_column_sums(const float* values, std::int64_t rows, std::int64_t columns, float* sum);

}  // namespace sdmt::nn
