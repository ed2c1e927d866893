// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/image/image.h"
#include "sdmt/train/augmentation.h"

namespace sdmt::train {

// `count` people who were never there: the upper part of one crop on the lower part of another,
// drawn by the seed.
std::vector<image::Image> made_up_people(const std::vector<image::Image>& crops, std::size_t count,
                                         std::uint64_t seed);

// Changes that turn the clothes and the light of a scene into those of many others.
AugmentationOptions foreign_colours();

}  // namespace sdmt::train
