// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/image.h"

// OpenCV's decoders and encoders of images, whose library brings a hundred others. They have a file
// of their own so that a program can put others here, which load them when they are needed; the
// binary does (tools/codecs).
namespace sdmt::media {

/// Upright by EXIF, in BGR; nothing for what OpenCV cannot decode.
std::optional<image::Image> decode_pixels(std::span<const std::uint8_t> bytes);

/// `extension` names the kind (".jpg"), `settings` are cv::imencode()'s.
std::vector<std::uint8_t> encode_pixels(const std::string& extension, const image::Image& image,
                                        const std::vector<int>& settings);

}  // namespace sdmt::media
