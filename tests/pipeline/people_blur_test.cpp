// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/people_blur.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

namespace sdmt::pipeline {
namespace {

// Stripes of one pixel, which a mosaic cannot keep.
image::Image stripes(int width, int height) {
  image::Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = x % 2 == 0 ? 0 : 200;
    }
  }
  return image;
}

TEST(PeopleBlur, LeavesNothingOfWhoIsInABoxAndTheRestAsItWas) {
  const image::Image before = stripes(200, 100);
  image::Image image = before;
  track::FinishedFrame frame;
  frame.boxes.push_back({.id = 1, .box = {41, 21, 40, 60}, .source = track::BoxSource::detected});
  frame.boxes.push_back(
      {.id = 2, .box = {121, 21, 32, 60}, .source = track::BoxSource::interpolated});
  frame.boxes.push_back({.id = 3, .box = {191, -50, 500, 90}});  // half outside
  frame.boxes.push_back({.id = 4, .box = {900, 900, 10, 10}});   // outside
  blur_people(frame, image);
  std::set<int> inside;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 200; ++x) {
      const auto in = [&](double left, double top, double width, double height) {
        return x >= left && x < left + width && y >= top && y < top + height;
      };
      if (in(40, 20, 40, 60) || in(120, 20, 32, 60) || in(190, 0, 10, 40)) {
        inside.insert(image.pixel(x, y)[0]);
      }
      // Beyond a tenth on each side and a pixel.
      if (!in(35, 13, 50, 74) && !in(115, 13, 42, 74) && !in(138, 0, 62, 51)) {
        ASSERT_EQ(image.pixel(x, y)[0], before.pixel(x, y)[0]) << x << ", " << y;
      }
    }
  }
  EXPECT_GE(*inside.begin(), 60);    // neither 0
  EXPECT_LE(*inside.rbegin(), 140);  // nor 200
}

}  // namespace
}  // namespace sdmt::pipeline
