// SPDX-License-Identifier: Apache-2.0
#include "scene_anchors.h"

#include <algorithm>

#include "random_stream.h"

namespace sdmt::train {

namespace {

// The rows of `below` from `share` of the height on, stretched over those of `above`.
image::Image composed(const image::Image& above, const image::Image& below, double share) {
  image::Image result = above;
  for (int y = static_cast<int>(share * above.height); y < above.height; ++y) {
    const int row = y * below.height / above.height;
    for (int x = 0; x < above.width; ++x) {
      std::copy_n(below.pixel(x * below.width / above.width, row), 3, result.pixel(x, y));
    }
  }
  return result;
}

}  // namespace

std::vector<image::Image> made_up_people(const std::vector<image::Image>& crops, std::size_t count,
                                         std::uint64_t seed) {
  auto random = random_stream(seed, Purpose::scene_anchors);
  std::vector<image::Image> people;
  for (std::size_t i = 0; i < count; ++i) {
    const image::Image& above = crops[random.below(crops.size())];
    const image::Image& below = crops[random.below(crops.size())];
    people.push_back(composed(above, below, random.uniform(0.35, 0.65)));
  }
  return people;
}

AugmentationOptions foreign_colours() {
  AugmentationOptions options;
  options.brightness = 0.5;
  options.contrast = 0.4;
  options.tint = 0.5;
  options.saturation = 0.5;
  options.gamma = 0.5;
  options.grey = 0.05;
  options.erase = 0.1;
  return options;
}

}  // namespace sdmt::train
