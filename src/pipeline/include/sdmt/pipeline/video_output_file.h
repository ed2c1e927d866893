// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "sdmt/image/image.h"
#include "sdmt/io/temporary_file.h"

namespace sdmt::pipeline {

/// Where frames of a video go.
class VideoOutput {
 public:
  virtual ~VideoOutput() = default;
  virtual void write(const image::Image& image) = 0;
  virtual void commit() = 0;
};

class VideoEncoder;

/// A video being written to an io::TemporaryFile; it appears under its name whole or not at all.
/// H.264 where OpenCV can encode it, else MPEG-4 part 2 (.mp4, .mkv, .mov) or Motion JPEG (.avi).
class VideoOutputFile : public VideoOutput {
 public:
  /// Throws std::invalid_argument when the extension (in upper or lower case) is unknown or the
  /// rate is not within 0.1 to 5000 frames a second (.avi: 1000), and as io::TemporaryFile does.
  VideoOutputFile(const std::filesystem::path& path, double frame_rate);
  ~VideoOutputFile() override;
  VideoOutputFile(const VideoOutputFile&) = delete;
  VideoOutputFile& operator=(const VideoOutputFile&) = delete;

  /// All frames have the size of the first; an odd last column or row is cut off. Throws
  /// std::runtime_error naming the path when no encoder can be had, std::invalid_argument for a
  /// frame below 2 x 2 pixels.
  void write(const image::Image& image) override;
  /// Throws std::runtime_error when not every frame can be read back (disk full).
  void commit() override;

 private:
  std::filesystem::path path_;
  std::unique_ptr<io::TemporaryFile> temporary_;
  std::unique_ptr<VideoEncoder> encoder_;
};

}  // namespace sdmt::pipeline
