// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/image/patch.h"
#include "sdmt/mot/box.h"

namespace sdmt::track {

/// Where a box lies in an image: MOTChallenge counts the first pixel as 1, the pixel plane begins
/// at 0.
inline image::PixelRect to_pixel_rect(const mot::Tlwh& box) {
  return {box.left - 1, box.top - 1, box.width, box.height};
}

}  // namespace sdmt::track
