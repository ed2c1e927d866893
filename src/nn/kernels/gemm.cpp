// SPDX-License-Identifier: Apache-2.0
#include "kernels/gemm.h"

#include <omp.h>

#include <algorithm>

#include "kernels/scratch.h"
#include "sdmt/io/first_error.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/gemm.cpp"
#include <hwy/foreach_target.h>
// Highway's order: the per-target headers come after foreach_target.h.
#include "kernels/micro_kernel-inl.h"

namespace sdmt::nn {
#ifndef SDMT_NN_GEMM_ONCE_
#define SDMT_NN_GEMM_ONCE_
/// Length of the sums that are kept in registers; fixes the order of summation.
constexpr std::int64_t kDepth = 256;
#endif
}  // namespace sdmt::nn

HWY_BEFORE_NAMESPACE();
namespace sdmt::nn {
namespace HWY_NAMESPACE {

/// Rows [0, rows) and columns [0, depth) of A in the order of MicroTile, panels of panel_rows rows.
void PackA(const MatrixView& a, std::int64_t rows, std::int64_t depth, int panel_rows,
           float* packed) {
  const FloatTag d;
  const std::int64_t chunks = (depth + kLanes - 1) / kLanes;
  for (std::int64_t row = 0; row < rows; row += panel_rows) {
    const int count = static_cast<int>(std::min<std::int64_t>(panel_rows, rows - row));
    float* panel = packed + row * chunks * kLanes;
    for (std::int64_t chunk = 0; chunk < chunks; ++chunk) {
      const std::int64_t k = chunk * kLanes;
      const int width = static_cast<int>(std::min<std::int64_t>(kLanes, depth - k));
      float* to = panel + chunk * count * kLanes;
      const float* from = a.data + row * a.row_stride + k * a.col_stride;
      if (a.col_stride == 1 && width == kLanes) {
        for (int i = 0; i < count; ++i) {
          hn::StoreU(hn::LoadU(d, from + i * a.row_stride), d, to + i * kLanes);
        }
      } else {
        for (int kk = 0; kk < width; ++kk) {
          for (int i = 0; i < count; ++i) {
            to[i * kLanes + kk] = from[i * a.row_stride + kk * a.col_stride];
          }
        }
      }
    }
  }
}

/// Rows [0, depth) and columns [0, columns) of B as panels of kColumns columns, the last one filled
/// with zeros.
void PackB(const MatrixView& b, std::int64_t depth, std::int64_t columns, float* packed) {
  const FloatTag d;
  for (std::int64_t column = 0; column < columns; column += kColumns) {
    const int count = static_cast<int>(std::min<std::int64_t>(kColumns, columns - column));
    float* panel = packed + column * depth;
    const float* from = b.data + column * b.col_stride;
    if (count < kColumns) std::fill_n(panel, depth * kColumns, 0.0F);
    if (b.col_stride == 1 && count == kColumns) {
      for (std::int64_t k = 0; k < depth; ++k) {
        hn::StoreU(hn::LoadU(d, from + k * b.row_stride), d, panel + k * kColumns);
        hn::StoreU(hn::LoadU(d, from + k * b.row_stride + kLanes), d,
                   panel + k * kColumns + kLanes);
      }
    } else {
      for (std::int64_t k = 0; k < depth; ++k) {
        for (int j = 0; j < count; ++j) {
          panel[k * kColumns + j] = from[k * b.row_stride + j * b.col_stride];
        }
      }
    }
  }
}

/// One block of C, in one thread.
void GemmBlock(std::int64_t m, std::int64_t n, std::int64_t k, const MatrixView& a,
               const MatrixView& b, const ProductView& c) {
  const int panel_rows = EvenRows(m);
  const std::int64_t padded_n = (n + kColumns - 1) / kColumns * kColumns;
  float* const packed_a = thread_scratch(ScratchUse::packed_a, m * (kDepth + kLanes));
  float* const packed_b = thread_scratch(ScratchUse::packed_b, padded_n * kDepth);
  alignas(64) float edge[kMaxRows * kColumns];  // a micro-tile that sticks out of C
  for (std::int64_t depth0 = 0; depth0 < k; depth0 += kDepth) {
    const std::int64_t depth = std::min(kDepth, k - depth0);
    const std::int64_t padded_depth = (depth + kLanes - 1) / kLanes * kLanes;
    const bool accumulate = c.accumulate || depth0 > 0;
    PackA({a.data + depth0 * a.col_stride, a.row_stride, a.col_stride}, m, depth, panel_rows,
          packed_a);
    PackB({b.data + depth0 * b.row_stride, b.row_stride, b.col_stride}, depth, n, packed_b);
    for (std::int64_t row = 0; row < m; row += panel_rows) {
      const int rows = static_cast<int>(std::min<std::int64_t>(panel_rows, m - row));
      for (std::int64_t column = 0; column < n; column += kColumns) {
        const std::int64_t columns = std::min<std::int64_t>(kColumns, n - column);
        float* const target = c.data + row * c.row_stride + column;
        const bool whole = columns == kColumns;
        const bool finished = depth0 + depth == k;
        const float* const bias = finished && c.bias != nullptr ? c.bias + column : nullptr;
        RunMicroTile(rows, MicroTile{.a = packed_a + row * padded_depth,
                                     .a_chunk = static_cast<std::ptrdiff_t>(rows) * kLanes,
                                     .b = packed_b + column * depth,
                                     .b_step = kColumns,
                                     .b_vector = kLanes,
                                     .c = whole ? target : edge,
                                     .c_row = whole ? c.row_stride : kColumns,
                                     .c_vector = kLanes,
                                     .k = depth,
                                     .accumulate = whole && accumulate,
                                     .bias = whole ? bias : nullptr,
                                     .relu = whole && finished && c.relu});
        if (whole) continue;
        for (int i = 0; i < rows; ++i) {
          for (std::int64_t j = 0; j < columns; ++j) {
            float value = edge[i * kColumns + j];
            if (accumulate) value += target[i * c.row_stride + j];
            if (bias != nullptr) value += bias[j];
            target[i * c.row_stride + j] = c.relu && finished && value < 0.0F ? 0.0F : value;
          }
        }
      }
    }
  }
}

// NOLINTNEXTLINE(google-readability-namespace-comments)
}  // namespace HWY_NAMESPACE
}  // namespace sdmt::nn
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sdmt::nn {

HWY_EXPORT(GemmBlock);

void gemm(std::int64_t m, std::int64_t n, std::int64_t k, MatrixView a, MatrixView b,
          ProductView c) {
  // A block's share of A and B fits the level-2 cache; smaller blocks when there are too few.
  constexpr std::int64_t kBlockRows = 168;  // a multiple of 14, 12 and 6
  constexpr std::int64_t kSmallestBlock = 64;
  std::int64_t block_columns = 512;
  const std::int64_t row_blocks = (m + kBlockRows - 1) / kBlockRows;
  const std::int64_t wanted = omp_in_parallel() != 0 ? 1 : 4LL * omp_get_max_threads();
  while (block_columns > kSmallestBlock &&
         row_blocks * ((n + block_columns - 1) / block_columns) < wanted) {
    block_columns /= 2;
  }
  const std::int64_t column_blocks = (n + block_columns - 1) / block_columns;
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (std::int64_t block = 0; block < row_blocks * column_blocks; ++block) {
    error.guard([&] {
      const std::int64_t row = block / column_blocks * kBlockRows;
      const std::int64_t column = block % column_blocks * block_columns;
      ProductView part = c;
      part.data += row * c.row_stride + column;
      if (c.bias != nullptr) part.bias += column;
      HWY_DYNAMIC_DISPATCH(GemmBlock)
      (std::min(kBlockRows, m - row), std::min(block_columns, n - column), k,
       MatrixView{a.data + row * a.row_stride, a.row_stride, a.col_stride},
       MatrixView{b.data + column * b.col_stride, b.row_stride, b.col_stride}, part);
    });
  }
  error.rethrow();
}

}  // namespace sdmt::nn
#endif
