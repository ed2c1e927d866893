// SPDX-License-Identifier: Apache-2.0
#include "video_encoder.h"

#include <fmt/core.h>

#include <cctype>
#include <map>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "frame_rates.h"
#include "mat_view.h"
#include "video_codec.h"

namespace sdmt::pipeline {

namespace fs = std::filesystem;

std::string lower_case_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

namespace {

// Encoders to try, best first, by what the container can hold.
const std::vector<int>& encoders(const fs::path& path) {
  constexpr int kH264 = codec_code("avc1");
  constexpr int kMpeg4 = codec_code("mp4v");
  constexpr int kMotionJpeg = codec_code("MJPG");
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

void check_video(const fs::path& path, double frame_rate) {
  encoders(path);
  // AVI's clock, as FFmpeg writes it, does not tell frames apart that are
  // closer than 1 ms.
  constexpr double kHighestOfAvi = 1000;
  const double highest = lower_case_extension(path) == ".avi" ? kHighestOfAvi : kHighestFrameRate;
  if (!(frame_rate >= kLowestFrameRate && frame_rate <= highest)) {
    throw std::invalid_argument(fmt::format("{}: frame rate is {}, expected {} to {} a second",
                                            path.string(), frame_rate, kLowestFrameRate, highest));
  }
}

VideoEncoder::VideoEncoder(fs::path shown, fs::path file, double frame_rate)
    : shown_(std::move(shown)), file_(std::move(file)), frame_rate_(frame_rate) {}

void VideoEncoder::open(int width, int height) {
  size_ = {width & ~1, height & ~1};
  if (size_.empty()) {
    throw std::invalid_argument(fmt::format("{}: frames of {} x {} pixels cannot be encoded",
                                            shown_.string(), width, height));
  }
  for (const int kind : encoders(shown_)) {
    writer_ = write_with_ffmpeg(file_.string(), kind, frame_rate_, size_);
    if (writer_->isOpened()) return;
  }
  writer_.reset();
  throw std::runtime_error(shown_.string() +
                           ": cannot be opened for writing, or OpenCV has no encoder for it");
}

void VideoEncoder::write(const image::Image& image) {
  if (writer_ == nullptr) open(image.width, image.height);
  const cv::Mat view = mat_view(image);
  if (view.cols >= size_.width && view.rows >= size_.height) {
    writer_->write(view(cv::Rect({0, 0}, size_)));
  } else {
    cv::Mat resized;
    cv::resize(view, resized, size_);
    writer_->write(resized);
  }
  ++frames_;
}

}  // namespace sdmt::pipeline
