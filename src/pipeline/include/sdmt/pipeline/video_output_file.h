// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "sdmt/image/image.h"
#include "sdmt/io/temporary_file.h"

namespace sdmt::pipeline {

/// A video being written to an io::TemporaryFile; it appears under its name whole or not at all.
/// H.264 where OpenCV can encode it, else MPEG-4 part 2 (.mp4, .mkv, .mov) or Motion JPEG (.avi).
class VideoOutputFile {
 public:
  /// Throws std::invalid_argument when the extension (in upper or lower case) is unknown or the
  /// rate is not within 0.1 to 5000 frames a second (.avi: 1000), and as io::TemporaryFile does.
  VideoOutputFile(const std::filesystem::path& path, double frame_rate);
  ~VideoOutputFile();
  VideoOutputFile(const VideoOutputFile&) = delete;
  VideoOutputFile& operator=(const VideoOutputFile&) = delete;

  /// All frames have the size of the first; an odd last column or row is cut off. Throws
  /// std::runtime_error naming the path when no encoder can be had, std::invalid_argument for a
  /// frame below 2 x 2 pixels.
  void write(const image::Image& image);
  /// Throws std::runtime_error when not every frame can be read back (disk full).
  void commit();

 private:
  struct Encoder;
  void open(int width, int height);

  std::filesystem::path path_;
  double frame_rate_;
  std::unique_ptr<io::TemporaryFile> temporary_;
  std::unique_ptr<Encoder> encoder_;
  int frames_ = 0;
};

}  // namespace sdmt::pipeline
