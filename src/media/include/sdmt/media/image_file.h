// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/image.h"

namespace sdmt::media {

/// Decodes a JPEG or PNG file (grey and alpha are converted). Throws std::invalid_argument naming
/// the file when it is missing, not an image, or damaged.
image::Image read_image(const std::filesystem::path& path);

/// The images of `paths` in the same order, decoded by all threads; nullopt where read_image()
/// throws.
std::vector<std::optional<image::Image>> read_images(std::span<const std::filesystem::path> paths);

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
