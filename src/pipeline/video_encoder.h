// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/videoio.hpp>
#include <string>

#include "sdmt/image/image.h"

namespace sdmt::pipeline {

/// The extension in lower case, which names the container.
std::string lower_case_extension(const std::filesystem::path& path);

/// Throws std::invalid_argument for an extension or a rate that VideoOutputFile
/// refuses.
void check_video(const std::filesystem::path& path, double frame_rate);

/// Frames into a video file that others see as it grows.
class VideoEncoder {
 public:
  /// `shown` names the video in messages, and by its extension the container;
  /// `file` is written.
  VideoEncoder(std::filesystem::path shown, std::filesystem::path file, double frame_rate);

  /// As VideoOutputFile::write().
  void write(const image::Image& image);
  int frames() const { return frames_; }
  /// Ends the file.
  void close() { writer_.reset(); }

 private:
  void open(int width, int height);

  std::filesystem::path shown_, file_;
  double frame_rate_;
  std::unique_ptr<cv::VideoWriter> writer_;  // nothing before the first frame
  cv::Size size_;                            // empty before the first frame
  int frames_ = 0;
};

}  // namespace sdmt::pipeline
