// SPDX-License-Identifier: Apache-2.0
#include "sdmt/media/image_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "image_codec.h"
#include "image_truncation.h"
#include "jpeg_decoder.h"
#include "sdmt/io/first_error.h"

namespace sdmt::media {

namespace {

std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument(path.string() + ": " + why);
  };
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    refuse(errno == ENOENT ? "does not exist" : std::strerror(errno));
  }
  // Opening a pipe would wait for its writer.
  if (!S_ISREG(status.st_mode)) refuse("is not a regular file, expected an image");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             std::fclose);
  if (file == nullptr) refuse(std::string("cannot be opened: ") + std::strerror(errno));
  // A byte more than expected shows the end, also of a file that has grown meanwhile.
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(status.st_size) + 1);
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  if (std::ferror(file.get()) != 0) {
    throw std::runtime_error(path.string() + ": read failed: " + std::strerror(errno));
  }
  return bytes;
}

std::optional<image::Image> decode(std::span<const std::uint8_t> bytes) {
  auto image = decode_plain_jpeg(bytes);
  return image ? std::move(image) : decode_pixels(bytes);
}

}  // namespace

image::Image read_image(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path);
  if (is_truncated_image(bytes)) {
    throw std::invalid_argument(path.string() + ": not a readable image: it is cut short");
  }
  auto image = decode(bytes);
  if (!image) throw std::invalid_argument(path.string() + ": not a readable image");
  return std::move(*image);
}

image::Image decode_image(std::span<const std::uint8_t> bytes) {
  auto image = decode(bytes);
  if (!image) throw std::invalid_argument("not the bytes of an image");
  return std::move(*image);
}

std::vector<std::uint8_t> encode_jpeg(const image::Image& image, int quality) {
  return encode_pixels(".jpg", image, {cv::IMWRITE_JPEG_QUALITY, quality});
}

std::vector<std::uint8_t> encode_png(const image::Image& image) {
  return encode_pixels(".png", image, {});
}

std::vector<std::optional<image::Image>> read_images(std::span<const std::filesystem::path> paths) {
  std::vector<std::optional<image::Image>> images(paths.size());
  io::FirstError error;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t i = 0; i < paths.size(); ++i) {
    error.guard([&] {
      try {
        images[i] = read_image(paths[i]);
      } catch (const std::invalid_argument&) {
      } catch (const std::runtime_error&) {  // left out, as every other that cannot be read
      }
    });
  }
  error.rethrow();
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
