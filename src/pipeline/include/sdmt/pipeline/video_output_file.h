// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "sdmt/image/image.h"

namespace sdmt::pipeline {

/// A video being written; it appears under its name whole or not at all. H.264 where OpenCV can
/// encode it, else MPEG-4 part 2 (.mp4, .mkv, .mov) or Motion JPEG (.avi). Until commit() it is in
/// a hidden folder beside `path` that belongs to this writer alone; what a killed program left
/// there is taken over. A path that is a link stays one: the file that it names is written.
class VideoOutputFile {
 public:
  /// Throws std::invalid_argument when the folder does not exist, `path` is there and not a regular
  /// file, the extension (in upper or lower case) is unknown, or the rate is not within 0.1 to 5000
  /// frames a second; std::runtime_error when another program is writing `path`.
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
  class TemporaryFolder;
  struct Encoder;
  void open(int width, int height);

  std::filesystem::path path_;
  double frame_rate_;
  std::unique_ptr<TemporaryFolder> folder_;
  std::unique_ptr<Encoder> encoder_;
  int frames_ = 0;
};

}  // namespace sdmt::pipeline
