// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/image.h"

namespace sdmt::media {

/// Decodes an image file of any kind that OpenCV reads (JPEG, PNG, BMP, PPM, TIFF, WebP; grey and
/// alpha are converted), turned upright by its EXIF orientation. Throws std::invalid_argument
/// naming the file when it is missing, no regular file, not an image, or cut short;
/// std::runtime_error when the medium fails while it is read.
image::Image read_image(const std::filesystem::path& path);

/// The images of `paths` in the same order, decoded by all threads; nullopt where read_image()
/// throws one of its two errors. Any other exception (std::bad_alloc) comes through.
std::vector<std::optional<image::Image>> read_images(std::span<const std::filesystem::path> paths);

/// The bytes of a JPEG file; `quality` 1..100.
std::vector<std::uint8_t> encode_jpeg(const image::Image& image, int quality);
/// The bytes of a PNG file.
std::vector<std::uint8_t> encode_png(const image::Image& image);
/// The reverse of both. Throws std::invalid_argument when the bytes are no image.
image::Image decode_image(std::span<const std::uint8_t> bytes);

/// Counts images that could not be read and refuses to go on when there are too many.
class UnreadableImages {
 public:
  /// At most `limit` of `total` images (a fraction) may be unreadable.
  explicit UnreadableImages(std::size_t total, double limit = 0.01)
      : total_(total), limit_(limit) {}

  /// Throws std::invalid_argument naming the first files when the limit is passed.
  void add(const std::filesystem::path& path);

  std::size_t count() const { return paths_.size(); }
  const std::vector<std::filesystem::path>& paths() const { return paths_; }

 private:
  std::size_t total_;
  double limit_;
  std::vector<std::filesystem::path> paths_;
};

}  // namespace sdmt::media
