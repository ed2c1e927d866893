// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/videoio.hpp>

namespace sdmt::pipeline {

/// A video being written; it appears under its name whole or not at all. H.264 where OpenCV can
/// encode it, else MPEG-4 part 2 (.mp4, .mkv, .mov) or Motion JPEG (.avi).
class VideoFile {
 public:
  /// Throws std::invalid_argument when the folder does not exist, `path` is there and not a regular
  /// file, or the extension is unknown.
  VideoFile(std::filesystem::path path, double frame_rate);
  ~VideoFile();
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  /// All frames have the size of the first; an odd last column or row is cut off. Throws
  /// std::runtime_error naming the path when no encoder can be had, std::invalid_argument for a
  /// frame below 2 x 2 pixels.
  void write(const cv::Mat& image);
  /// Throws std::runtime_error when the file is not as long as what was written (disk full).
  void commit();

 private:
  void open(cv::Size size);

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  double frame_rate_;
  cv::Size size_;
  cv::VideoWriter writer_;
  int frames_ = 0;
};

}  // namespace sdmt::pipeline
