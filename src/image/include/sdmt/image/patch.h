// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "sdmt/image/image_view.h"
#include "sdmt/image/preprocessing.h"

namespace sdmt::image {

/// A rectangle in the pixel plane of an image: the first pixel covers [0, 1) x [0, 1). May leave
/// the image. (MOTChallenge boxes count from 1: subtract 1 from left and top first.)
struct PixelRect {
  double left = 0;
  double top = 0;
  double width = 0;
  double height = 0;
};

/// Whole pixels inside an image: columns [left, right), rows [top, bottom).
struct PixelRegion {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;

  int width() const { return right - left; }
  int height() const { return bottom - top; }
  bool operator==(const PixelRegion&) const = default;
};

/// The part of `rect` inside an image of the given size, its edges rounded to the nearest pixel
/// boundary (halves to even). Nothing when it is not worth looking at: less than 2 x 2 pixels
/// visible, less than a tenth of the rectangle's area visible, or a value that is not finite.
std::optional<PixelRegion> visible_region(int image_width, int image_height, const PixelRect& rect);

/// Writes the network's input for one box: visible_region() of `rect`, stretched bilinearly to
/// preprocessing.height x preprocessing.width (half-pixel centres, replicated edges, rounded to 8
/// bits: bit for bit the same as cv2.resize with INTER_LINEAR on 8-bit pictures), channels
/// reordered, scaled and normalised. `out` takes height * width * 3 floats, channels last. Returns
/// false, with `out` untouched, when there is no visible region or the image is empty. Reads
/// nothing outside the visible region.
bool extract_patch(const ImageView& image, const PixelRect& rect,
                   const Preprocessing& preprocessing, float* out);

}  // namespace sdmt::image
