// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/video_file.h"

#include <fmt/core.h>
#include <unistd.h>

#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

// Encoders to try, best first, by what the container can hold.
const std::vector<int>& encoders(const fs::path& path) {
  static const int kH264 = cv::VideoWriter::fourcc('a', 'v', 'c', '1');
  static const int kMpeg4 = cv::VideoWriter::fourcc('m', 'p', '4', 'v');
  static const int kMotionJpeg = cv::VideoWriter::fourcc('M', 'J', 'P', 'G');
  static const std::map<std::string, std::vector<int>> kByExtension{{".mp4", {kH264, kMpeg4}},
                                                                    {".mov", {kH264, kMpeg4}},
                                                                    {".mkv", {kH264, kMpeg4}},
                                                                    {".avi", {kMotionJpeg}}};
  const auto found = kByExtension.find(path.extension().string());
  if (found == kByExtension.end()) {
    throw std::invalid_argument(path.string() + ": unknown kind of video, expected the extension " +
                                ".mp4, .mov, .mkv or .avi");
  }
  return found->second;
}

}  // namespace

VideoFile::VideoFile(fs::path path, double frame_rate)
    : path_(std::move(path)), frame_rate_(frame_rate) {
  encoders(path_);
  std::error_code ignored;
  const auto folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    throw std::invalid_argument(
        fmt::format("{}: folder {} does not exist", path_.string(), folder.string()));
  }
  if (fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored)) {
    throw std::invalid_argument(path_.string() + ": is not a regular file");
  }
  // The extension stays last: the container is chosen by it.
  temporary_ = folder / fmt::format(".{}.{}.tmp{}", path_.stem().string(), getpid(),
                                    path_.extension().string());
}

VideoFile::~VideoFile() {
  writer_.release();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void VideoFile::open(cv::Size size) {
  size_ = {size.width & ~1, size.height & ~1};
  if (size_.empty()) {
    throw std::invalid_argument(fmt::format("{}: frames of {} x {} pixels cannot be encoded",
                                            path_.string(), size.width, size.height));
  }
  for (const int encoder : encoders(path_)) {
    if (writer_.open(temporary_.string(), cv::CAP_FFMPEG, encoder, frame_rate_, size_)) return;
  }
  throw std::runtime_error(path_.string() +
                           ": cannot be opened for writing, or OpenCV has no encoder for it");
}

void VideoFile::write(const cv::Mat& image) {
  if (!writer_.isOpened()) open(image.size());
  if (image.cols >= size_.width && image.rows >= size_.height) {
    writer_.write(image(cv::Rect({0, 0}, size_)));
  } else {
    cv::Mat resized;
    cv::resize(image, resized, size_);
    writer_.write(resized);
  }
  ++frames_;
}

void VideoFile::commit() {
  if (frames_ == 0) throw std::runtime_error(path_.string() + ": there are no frames to write");
  writer_.release();
  // cv::VideoWriter does not say when the disk is full; the file does.
  cv::VideoCapture written(temporary_.string());
  if (!written.isOpened() || written.get(cv::CAP_PROP_FRAME_COUNT) < frames_) {
    throw std::runtime_error(path_.string() + ": writing failed (is the disk full?)");
  }
  std::error_code failed;
  fs::rename(temporary_, path_, failed);
  if (failed) throw std::runtime_error(path_.string() + ": rename failed: " + failed.message());
}

}  // namespace sdmt::pipeline
