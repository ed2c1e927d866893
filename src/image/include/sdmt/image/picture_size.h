// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::image {

/// Pixels; 0 and 0 where it is not known.
struct PictureSize {
  int width = 0;
  int height = 0;
  bool operator==(const PictureSize&) const = default;
};

}  // namespace sdmt::image
