// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace sdmt::nn {

/// A matrix in somebody else's memory: element (i, j) stands at data[i * row_stride + j *
/// col_stride].
struct MatrixView {
  const float* data = nullptr;
  std::ptrdiff_t row_stride = 0;
  std::ptrdiff_t col_stride = 1;
};

/// Where a product goes: element (i, j) at data[i * row_stride + j].
struct ProductView {
  float* data = nullptr;
  std::ptrdiff_t row_stride = 0;
  bool accumulate = false;      ///< add to what is there
  const float* bias = nullptr;  ///< n values added to every row
  bool relu = false;            ///< negative results become 0
};

/// C = A B for A [m,k] and B [k,n]. Every element of C is summed in the same order of k whatever m,
/// n and the number of threads: a row of a product is the product of that row. Parallel over blocks
/// of C, unless called from inside a parallel region.
void gemm(std::int64_t m, std::int64_t n, std::int64_t k, MatrixView a, MatrixView b,
          ProductView c);

}  // namespace sdmt::nn
