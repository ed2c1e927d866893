// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "sdmt/mot/box.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::mot {

/// What makes boxes that can be read unlikely to be left, top, width and height in pixels of a
/// picture of `width` x `height` (0: not known), and the cure, in one sentence without a full stop;
/// empty when nothing does. Recognised: boxes in fractions of the picture, two corners in place of
/// corner and size, centres in place of corners, and boxes of a picture of another size. Few boxes
/// say little: below 20, only fractions are recognised.
std::string describe_implausible(std::span<const Tlwh> boxes, int width, int height);

/// Also: more columns than the format has, as decimal commas make, and boxes of several classes.
std::string describe_implausible(const DetectionFile& file, int width, int height);

}  // namespace sdmt::mot
