// SPDX-License-Identifier: Apache-2.0
#include "jpeg_decoder.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <string_view>
#include <type_traits>

namespace sdmt::media {

std::optional<image::Image> decode_plain_jpeg(std::span<const std::uint8_t> bytes) {
  constexpr std::int64_t kMostPixels = std::int64_t{1} << 27;
  constexpr std::string_view kExif("Exif\0", 5);
  if (bytes.size() < 2 || bytes[0] != 0xFF || bytes[1] != 0xD8) return std::nullopt;
  if (bytes.size() > std::numeric_limits<unsigned int>::max()) return std::nullopt;
  if (std::search(bytes.begin(), bytes.end(), kExif.begin(), kExif.end()) != bytes.end()) {
    return std::nullopt;
  }
  const auto length = static_cast<unsigned long>(bytes.size());
  const std::unique_ptr<std::remove_pointer_t<tjhandle>, int (*)(tjhandle)> decoder(
      tjInitDecompress(), tjDestroy);
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colours = 0;
  if (decoder == nullptr || tjDecompressHeader3(decoder.get(), bytes.data(), length, &width,
                                                &height, &subsampling, &colours) != 0) {
    return std::nullopt;
  }
  if (colours != TJCS_YCbCr && colours != TJCS_GRAY) return std::nullopt;
  if (width < 1 || height < 1 || std::int64_t{width} * height > kMostPixels) return std::nullopt;
  image::Image image(width, height);
  if (tjDecompress2(decoder.get(), bytes.data(), length, image.pixel(0, 0), width, 3 * width,
                    height, TJPF_BGR, TJFLAG_STOPONWARNING) != 0) {
    return std::nullopt;
  }
  return image;
}

}  // namespace sdmt::media
