// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdmt/image/image_view.h"

namespace sdmt::image {

/// An 8-bit BGR image that owns its pixels, rows without gaps.
struct Image {
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels
  std::vector<std::uint8_t> bgr;

  Image() = default;
  Image(int width_, int height_)
      : width(width_),
        height(height_),
        bgr(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3) {}

  ImageView view() const {
    return {bgr.data(), width, height, static_cast<std::ptrdiff_t>(width) * 3, ChannelOrder::bgr};
  }
  std::uint8_t* pixel(int x, int y) {
    return bgr.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)) *
                            3;
  }
  const std::uint8_t* pixel(int x, int y) const {
    return bgr.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)) *
                            3;
  }
};

}  // namespace sdmt::image
