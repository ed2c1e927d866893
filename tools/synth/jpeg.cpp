// SPDX-License-Identifier: Apache-2.0
#include "synth/jpeg.h"

#include <opencv2/imgcodecs.hpp>

#include "sdmt/io/output_file.h"

namespace sdmt::tools {

std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return bytes;
}

void write_jpeg(const std::filesystem::path& path, const cv::Mat& image, int quality) {
  const auto bytes = encode_jpeg(image, quality);
  io::OutputFile file(path);
  file.write(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace sdmt::tools
