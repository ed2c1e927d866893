// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "kernels/gemm.h"

namespace sdmt::nn {

/// C = X W^T for X [m,k] and W [n,k], both dense: a fully connected layer. Reads W once, where it
/// lies, at the speed of memory when m is small. Each value is summed in an order that k alone
/// fixes.
void multiply_rows(std::int64_t m, std::int64_t n, std::int64_t k, const float* x, const float* w,
                   ProductView c);

/// Adds up what the parts of a long sum gave, in their order: C [m,n] from
/// sums[(part * m + i) * sums_row + j].
void add_parts(std::int64_t m, std::int64_t n, const float* sums, std::int64_t parts,
               std::ptrdiff_t sums_row, ProductView c);

}  // namespace sdmt::nn
