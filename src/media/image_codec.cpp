// SPDX-License-Identifier: Apache-2.0
#include "image_codec.h"

#include <cstring>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace sdmt::media {

std::optional<image::Image> decode_pixels(std::span<const std::uint8_t> bytes) {
  cv::Mat decoded;
  try {
    const cv::Mat view(1, static_cast<int>(bytes.size()), CV_8UC1,
                       const_cast<std::uint8_t*>(bytes.data()));
    if (!bytes.empty()) decoded = cv::imdecode(view, cv::IMREAD_COLOR);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw std::bad_alloc();
    return std::nullopt;
  }
  if (decoded.empty()) return std::nullopt;
  image::Image image(decoded.cols, decoded.rows);
  for (int y = 0; y < decoded.rows; ++y) {
    std::memcpy(image.pixel(0, y), decoded.ptr(y), static_cast<std::size_t>(decoded.cols) * 3);
  }
  return image;
}

std::vector<std::uint8_t> encode_pixels(const std::string& extension, const image::Image& image,
                                        const std::vector<int>& settings) {
  const cv::Mat view(image.height, image.width, CV_8UC3,
                     const_cast<std::uint8_t*>(image.bgr.data()));
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, view, bytes, settings);
  return bytes;
}

}  // namespace sdmt::media
