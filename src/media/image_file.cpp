// SPDX-License-Identifier: Apache-2.0
#include "sdmt/media/image_file.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace sdmt::media {

namespace {

// A JPEG cut short still decodes, with grey below the cut: its end marker is what tells.
bool is_cut_jpeg(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < 4 || bytes[0] != 0xFF || bytes[1] != 0xD8) return false;
  for (std::size_t i = bytes.size() - 1; i > 1; --i) {
    if (bytes[i] == 0xD9 && bytes[i - 1] == 0xFF) return false;
  }
  return true;
}

}  // namespace

image::Image read_image(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::invalid_argument(path.string() + ": cannot be opened");
  const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(file)),
                                        std::istreambuf_iterator<char>());
  cv::Mat decoded;
  try {
    if (!bytes.empty() && !is_cut_jpeg(bytes)) decoded = cv::imdecode(bytes, cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    decoded.release();  // reported below, as every other damage
  }
  if (decoded.empty()) {
    throw std::invalid_argument(path.string() + ": not a readable JPEG or PNG image");
  }
  image::Image image(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) {
    std::memcpy(image.pixel(0, y), decoded.ptr(y), static_cast<std::size_t>(decoded.cols) * 3);
  }
  return image;
}

std::vector<std::optional<image::Image>> read_images(std::span<const std::filesystem::path> paths) {
  std::vector<std::optional<image::Image>> images(paths.size());
  const auto count = static_cast<std::ptrdiff_t>(paths.size());
#pragma omp parallel for schedule(dynamic)
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    try {
      images[at] = read_image(paths[at]);
    } catch (const std::invalid_argument&) {
      images[at] = std::nullopt;
    }
  }
  return images;
}

void UnreadableImages::add(const std::filesystem::path& path) {
  paths_.push_back(path);
  if (static_cast<double>(paths_.size()) <= limit_ * static_cast<double>(total_)) return;
  constexpr std::size_t kNamed = 3;
  std::string message = std::to_string(paths_.size()) + " of " + std::to_string(total_) +
                        " images cannot be read, more than the allowed " +
                        std::to_string(limit_ * 100).substr(0, 3) + " %:";
  for (std::size_t i = 0; i < paths_.size() && i < kNamed; ++i) message += " " + paths_[i].string();
  throw std::invalid_argument(message);
}

}  // namespace sdmt::media
