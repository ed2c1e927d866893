// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "sdmt/nn/random.h"

namespace sdmt::tools {

/// What a piece of cloth looks like.
struct Cloth {
  enum class Pattern { plain, horizontal_stripes, vertical_stripes, checks, dots, two_tone };
  Pattern pattern = Pattern::plain;
  cv::Vec3b color;         ///< BGR
  cv::Vec3b second_color;  ///< of stripes, checks, dots, or the lower part
  double period = 12;      ///< of the pattern, in 1/256 of the body's height
};

/// A made-up pedestrian: all that stays the same from image to image.
struct PersonLook {
  Cloth top;
  Cloth bottom;
  cv::Vec3b skin;
  cv::Vec3b hair;
  cv::Vec3b shoes;
  enum class Legs { trousers, shorts, skirt } legs = Legs::trousers;
  enum class Sleeves { longs, shorts } sleeves = Sleeves::longs;
  enum class Head { short_hair, long_hair, hat } head = Head::short_hair;
  enum class Bag { none, backpack, shoulder } bag = Bag::none;
  cv::Vec3b bag_color;
  bool open_jacket = false;  ///< shows `inner` in front
  cv::Vec3b inner;
  double build = 1.0;  ///< width of the body, 1 = average
};

/// A new person. The same generator state gives the same person.
PersonLook random_look(nn::Random& random);

/// How the person stands in one image.
struct PersonPose {
  double phase = 0;   ///< of the walking cycle, 0..1; both legs pass each other at 0 and 0.5
  double facing = 0;  ///< degrees: 0 walks towards the camera, 90 to the right, 180 away
  double lean = 0;    ///< sideways shift of the head, in parts of the height
};

/// Draws the person into `box` of the BGR image: crown at the top edge, soles at the bottom, body
/// in the middle; arms and legs keep within it when the box is 0.41 or more as wide as high. What
/// leaves the image is cut off. `light` multiplies the colours (1 = as they are).
void draw_person(cv::Mat& image, const PersonLook& look, const PersonPose& pose,
                 const cv::Rect2d& box, double light = 1.0);

}  // namespace sdmt::tools
