// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/video_output_file.h"

#include <fmt/core.h>

#include <cctype>
#include <map>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "container_end.h"
#include "ffmpeg_capture.h"
#include "frame_rates.h"
#include "mat_view.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

std::string lower_case_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// Encoders to try, best first, by what the container can hold.
const std::vector<int>& encoders(const fs::path& path) {
  static const int kH264 = cv::VideoWriter::fourcc('a', 'v', 'c', '1');
  static const int kMpeg4 = cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  static const int kMotionJpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  static const std::map<std::string, std::vector<int>> kByExtension{{".mp4", {kH264, kMpeg4}},
                                                                    {".mov", {kH264, kMpeg4}},
                                                                    {".mkv", {kH264, kMpeg4}},
                                                                    {".avi", {kMotionJpeg}}};
  const auto found = kByExtension.find(lower_case_extension(path));
  if (found == kByExtension.end()) {
    throw std::invalid_argument(path.string() + ": unknown kind of video, expected the extension " +
                                ".mp4, .mov, .mkv or .avi");
  }
  return found->second;
}

}  // namespace

struct VideoOutputFile::Encoder {
  cv::VideoWriter writer;
  cv::Size size;
};

VideoOutputFile::VideoOutputFile(const fs::path& path, double frame_rate)
    : path_(path), frame_rate_(frame_rate) {
  encoders(path_);
  // AVI's clock, as FFmpeg writes it, does not tell frames apart that are closer than 1 ms.
  constexpr double kHighestOfAvi = 1000;
  const double highest = lower_case_extension(path_) == ".avi" ? kHighestOfAvi : kHighestFrameRate;
  if (!(frame_rate >= kLowestFrameRate && frame_rate <= highest)) {
    throw std::invalid_argument(fmt::format("{}: frame rate is {}, expected {} to {} a second",
                                            path_.string(), frame_rate, kLowestFrameRate, highest));
  }
  // The container is chosen by the name's end.
  temporary_ = std::make_unique<io::TemporaryFile>(path_, lower_case_extension(path_));
}

VideoOutputFile::~VideoOutputFile() = default;

void VideoOutputFile::open(int width, int height) {
  auto encoder = std::make_unique<Encoder>();
  encoder->size = {width & ~1, height & ~1};
  if (encoder->size.empty()) {
    throw std::invalid_argument(fmt::format("{}: frames of {} x {} pixels cannot be encoded",
                                            path_.string(), width, height));
  }
  for (const int kind : encoders(path_)) {
    if (encoder->writer.open(temporary_->path().string(), cv::CAP_FFMPEG, kind, frame_rate_,
                             encoder->size)) {
      encoder_ = std::move(encoder);
      return;
    }
  }
  throw std::runtime_error(path_.string() +
                           ": cannot be opened for writing, or OpenCV has no encoder for it");
}

void VideoOutputFile::write(const image::Image& image) {
  if (encoder_ == nullptr) open(image.width, image.height);
  const cv::Size size = encoder_->size;
  const cv::Mat view = mat_view(image);
  if (view.cols >= size.width && view.rows >= size.height) {
    encoder_->writer.write(view(cv::Rect({0, 0}, size)));
  } else {
    cv::Mat resized;
    cv::resize(view, resized, size);
    encoder_->writer.write(resized);
  }
  ++frames_;
}

void VideoOutputFile::commit() {
  if (frames_ == 0) throw std::runtime_error(path_.string() + ": there are no frames to write");
  encoder_->writer.release();
  // The encoder does not say when the disk is full, and a container only estimates its length.
  int readable = 0;
  auto written = open_with_ffmpeg(temporary_->path().string());
  while (written.isOpened() && readable < frames_ && written.grab()) ++readable;
  written.release();
  if (readable < frames_ || !ends_with_its_container(temporary_->path())) {
    throw std::runtime_error(
        fmt::format("{}: writing failed, {} of {} frames can be read back (is the disk full?)",
                    path_.string(), readable, frames_));
  }
  temporary_->commit();
}

}  // namespace sdmt::pipeline
