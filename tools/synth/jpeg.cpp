// SPDX-License-Identifier: Apache-2.0
#include "synth/jpeg.h"

#include "sdmt/io/output_file.h"
#include "sdmt/media/image_file.h"

namespace sdmt::tools {

std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality) {
  image::Image pixels(image.cols, image.rows);
  image.copyTo(cv::Mat(image.rows, image.cols, CV_8UC3, pixels.bgr.data()));
  return media::encode_jpeg(pixels, quality);
}

void write_jpeg(const std::filesystem::path& path, const cv::Mat& image, int quality) {
  const auto bytes = encode_jpeg(image, quality);
  io::OutputFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace sdmt::tools
