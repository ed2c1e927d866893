// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "sdmt/image/image.h"

namespace sdmt::media {

/// What decode_pixels() makes of a JPEG, value by value, without OpenCV's codecs and the memory of
/// their libraries: libjpeg-turbo is what decodes there too. In BGR; nothing for other kinds, and
/// for JPEGs that are not plain: with EXIF, which may say that they are to be turned, in other
/// colours than YCbCr or grey, of more than 2^27 pixels, or that the decoder has something to say
/// about.
std::optional<image::Image> decode_plain_jpeg(std::span<const std::uint8_t> bytes);

}  // namespace sdmt::media
