// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/nn/image_view.h"

namespace sdmt::train {

/// An 8-bit BGR image that owns its pixels, rows without gaps.
struct Image {
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels
  std::vector<std::uint8_t> bgr;

  Image() = default;
  Image(int width_, int height_)
      : width(width_),
        height(height_),
        bgr(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3) {}

  nn::ImageView view() const {
    return {bgr.data(), width, height, static_cast<std::ptrdiff_t>(width) * 3,
            nn::ChannelOrder::bgr};
  }
  std::uint8_t* pixel(int x, int y) {
    return bgr.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)) *
                            3;
  }
  const std::uint8_t* pixel(int x, int y) const {
    return bgr.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                         static_cast<std::size_t>(x)) *
                            3;
  }
};

/// Decodes a JPEG or PNG file (grey and alpha are converted). Throws std::invalid_argument naming
/// the file when it is missing, not an image, or damaged.
Image read_image(const std::filesystem::path& path);

/// The images of `paths` in the same order, decoded by all threads; nullopt where read_image()
/// throws.
std::vector<std::optional<Image>> read_images(std::span<const std::filesystem::path> paths);

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

}  // namespace sdmt::train
