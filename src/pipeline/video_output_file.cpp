// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/video_output_file.h"

#include <fmt/core.h>

#include <stdexcept>

#include "container_end.h"
#include "video_codec.h"
#include "video_encoder.h"

namespace sdmt::pipeline {

VideoOutputFile::VideoOutputFile(const std::filesystem::path& path, double frame_rate)
    : path_(path) {
  check_video(path, frame_rate);
  // The container is chosen by the name's end.
  temporary_ = std::make_unique<io::TemporaryFile>(path_, lower_case_extension(path_));
  encoder_ = std::make_unique<VideoEncoder>(path_, temporary_->path(), frame_rate);
}

VideoOutputFile::~VideoOutputFile() = default;

void VideoOutputFile::write(const image::Image& image) { encoder_->write(image); }

void VideoOutputFile::commit() {
  const int frames = encoder_->frames();
  if (frames == 0) throw std::runtime_error(path_.string() + ": there are no frames to write");
  encoder_->close();
  // The encoder does not say when the disk is full, and a container only
  // estimates its length.
  int readable = 0;
  const auto written = capture_with_ffmpeg(temporary_->path().string());
  while (written->isOpened() && readable < frames && written->grab()) ++readable;
  written->release();
  if (readable < frames || !ends_with_its_container(temporary_->path())) {
    throw std::runtime_error(
        fmt::format("{}: writing failed, {} of {} frames can be read back (is the disk full?)",
                    path_.string(), readable, frames));
  }
  temporary_->commit();
}

}  // namespace sdmt::pipeline
