// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/track/finished_frame.h"

namespace sdmt::zones {

/// Where people stood, and how long: person-seconds by cell of a grid over the picture.
class HeatMap {
 public:
  /// A picture of so many pixels, both at least 1; throws std::invalid_argument otherwise. The grid
  /// has 64 columns and rows of cells that are about square.
  HeatMap(int width, int height);

  /// Adds `seconds` (>= 0) in the cell of each box's foot, the middle of its lower edge. A foot
  /// outside of the picture counts in the nearest cell.
  void add(const track::FinishedFrame& frame, double seconds);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  /// [rows, columns], person-seconds.
  const std::vector<double>& cells() const { return cells_; }

 private:
  double width_, height_;
  int columns_ = 64;
  int rows_;
  std::vector<double> cells_;
};

}  // namespace sdmt::zones
