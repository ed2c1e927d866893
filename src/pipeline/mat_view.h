// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>

#include "sdmt/image/image.h"

namespace sdmt::pipeline {

/// The pixels of an image as OpenCV takes them, not copied.
inline cv::Mat mat_view(image::Image& image) {
  return {image.height, image.width, CV_8UC3, image.bgr.data()};
}
inline cv::Mat mat_view(const image::Image& image) {  // only to be read
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.bgr.data())};
}

/// A copy of an 8-bit BGR matrix.
inline image::Image to_image(const cv::Mat& mat) {
  image::Image image(mat.cols, mat.rows);
  mat.copyTo(mat_view(image));
  return image;
}

}  // namespace sdmt::pipeline
