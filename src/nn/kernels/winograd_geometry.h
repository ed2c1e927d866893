// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// Extent of an output tile: 2x4, 4x4 or 8x8.
struct WinogradTileSize {
  int height = 4;
  int width = 4;
  /// Positions of the transformed tile.
  int positions() const { return (height + 2) * (width + 2); }
  bool operator==(const WinogradTileSize&) const = default;
};

/// The output tiles of a batch, numbered image by image and row by row.
struct WinogradTiles {
  WinogradTileSize size;
  int height, width;  // of an image
  int rows, columns;  // of tiles in an image
  std::int64_t count;

  WinogradTiles(Shape image, WinogradTileSize tile)
      : size(tile),
        height(image.h),
        width(image.w),
        rows((image.h + tile.height - 1) / tile.height),
        columns((image.w + tile.width - 1) / tile.width),
        count(std::int64_t{image.n} * rows * columns) {}

  struct Place {
    int image;
    int top, left;  // first output pixel
  };
  Place place(std::int64_t tile) const {
    const std::int64_t per_image = std::int64_t{rows} * columns;
    const auto within = static_cast<int>(tile % per_image);
    return {static_cast<int>(tile / per_image), within / columns * size.height,
            within % columns * size.width};
  }
};

}  // namespace sdmt::nn
