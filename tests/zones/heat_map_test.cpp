// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/heat_map.h"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>

namespace sdmt::zones {
namespace {

track::FinishedFrame frame_with(const mot::Tlwh& box) {
  track::FinishedFrame frame;
  frame.boxes.push_back({.id = 1, .box = box});
  return frame;
}

TEST(HeatMap, CountsSecondsWhereTheFeetAre) {
  HeatMap map(640, 480);  // cells of 10 x 10
  EXPECT_EQ(map.columns(), 64);
  EXPECT_EQ(map.rows(), 48);
  map.add(frame_with({100, 100, 20, 55}),
          0.5);  // foot 110, 155: 109 and 154 pixels after the first
  map.add(frame_with({101, 101, 20, 55}), 0.25);
  EXPECT_DOUBLE_EQ(map.cells()[15 * 64 + 10], 0.5);
  EXPECT_DOUBLE_EQ(map.cells()[15 * 64 + 11], 0.25);
}

TEST(HeatMap, KeepsFeetOutsideOfThePicture) {
  HeatMap map(640, 480);
  map.add(frame_with({-100, 400, 20, 500}), 1);
  map.add(frame_with({700, -400, 20, 100}), 1);
  EXPECT_DOUBLE_EQ(map.cells()[47 * 64], 1);
  EXPECT_DOUBLE_EQ(map.cells()[63], 1);
  EXPECT_DOUBLE_EQ(std::accumulate(map.cells().begin(), map.cells().end(), 0.0), 2);
}

TEST(HeatMap, RefusesAPictureWithoutPixels) {
  EXPECT_THROW(HeatMap(0, 480), std::invalid_argument);
  EXPECT_THROW(HeatMap(640, -1), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::zones
