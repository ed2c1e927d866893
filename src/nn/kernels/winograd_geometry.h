// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// The 4x4 output tiles of a batch, numbered image by image and row by row.
struct WinogradTiles {
  int height, width;  // of an image
  int rows, columns;  // of tiles in an image
  std::int64_t count;

  explicit WinogradTiles(Shape image)
      : height(image.h),
        width(image.w),
        rows((image.h + 3) / 4),
        columns((image.w + 3) / 4),
        count(std::int64_t{image.n} * rows * columns) {}

  struct Place {
    int image;
    int top, left;  // first output pixel
  };
  Place place(std::int64_t tile) const {
    const std::int64_t per_image = std::int64_t{rows} * columns;
    const auto within = static_cast<int>(tile % per_image);
    return {static_cast<int>(tile / per_image), within / columns * 4, within % columns * 4};
  }
};

}  // namespace sdmt::nn
