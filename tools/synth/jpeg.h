// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace sdmt::tools {

/// The bytes of a JPEG file; `quality` 1..100.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat& image, int quality);

/// Writes a JPEG file, whole or not at all. Throws as io::OutputFile.
void write_jpeg(const std::filesystem::path& path, const cv::Mat& image, int quality);

}  // namespace sdmt::tools
