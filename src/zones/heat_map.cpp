// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/heat_map.h"

#include <algorithm>
#include <cmath>

#include "sdmt/io/checked_value.h"

namespace sdmt::zones {

HeatMap::HeatMap(int width, int height) : width_(width), height_(height) {
  io::require(width >= 1, "width", width, "at least 1");
  io::require(height >= 1, "height", height, "at least 1");
  rows_ = std::clamp(static_cast<int>(std::lround(columns_ * height_ / width_)), 1, 1024);
  cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0);
}

void HeatMap::add(const track::FinishedFrame& frame, double seconds) {
  const auto cell = [](double place, double size, int count) {
    return static_cast<int>(std::clamp((place - 1) / size * count, 0.0, count - 1.0));
  };
  for (const track::TrackedBox& box : frame.boxes) {
    const int column = cell(box.box.left + box.box.width / 2, width_, columns_);
    const int row = cell(box.box.top + box.box.height, height_, rows_);
    cells_[row * columns_ + column] += seconds;
  }
}

}  // namespace sdmt::zones
