// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace sdmt::media {

/// Whether the bytes of an image file end before the image does. Decoders fill what is missing with
/// grey and call it an image; the structure of the file tells. JPEG: the end marker after the
/// scans, not one inside a segment, as that of a thumbnail. PNG: the chunks up to IEND, with their
/// checksums. TIFF: the strips or tiles of its first picture. WebP: the length in its header. False
/// for other kinds, whose decoders notice by themselves. Bytes behind the end do not matter.
bool is_truncated_image(std::span<const std::uint8_t> bytes);

}  // namespace sdmt::media
