// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace sdmt::image {

// Stretching of 8-bit pictures in the fixed point of cv2.resize, so that what we compute from a
// stretched picture is what a Python pipeline computes: weights are multiples of 1 / 2048, a row
// stretched sideways keeps 7 bits below the point, and the two products that mix rows are cut to 2
// bits below the point before the sum is rounded to 8 bits.

// An output pixel lies between source pixels low and high (the same one at an edge).
struct BilinearTap {
  // `fraction` of the way from pixel `position` to the next, of `count` source pixels.
  BilinearTap(int position, float fraction, int count);

  int low;
  int high;
  std::int16_t low_weight;
  std::int16_t high_weight;
};

// Rows of a stretched picture, from top to bottom.
class BilinearStretch {
 public:
  // `origin` is the first pixel of three channels, rows are `stride` bytes apart; `columns` has one
  // tap for each output column. Output channel c is source channel channels[c].
  BilinearStretch(const std::uint8_t* origin, std::ptrdiff_t stride,
                  std::vector<BilinearTap> columns, std::array<int, 3> channels);

  // Fills `out` (columns x 3 values) with the output row between two source rows.
  void row(const BilinearTap& rows, std::span<std::uint8_t> out);

 private:
  const std::int16_t* stretched(int y);

  const std::uint8_t* origin_;
  std::ptrdiff_t stride_;
  std::vector<BilinearTap> columns_;  // in bytes
  std::array<int, 3> channels_;
  // A source row serves several output rows, so the last two are kept.
  std::array<std::vector<std::int16_t>, 2> kept_;
  std::array<int, 2> kept_row_{-1, -1};
};

}  // namespace sdmt::image
