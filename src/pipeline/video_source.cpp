// SPDX-License-Identifier: Apache-2.0
#include "video_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "display_matrix.h"
#include "frame_rates.h"
#include "mat_view.h"
#include "video_codec.h"

namespace sdmt::pipeline {

namespace {

// What OpenCV knows of the orientation. Before 4.7 it counted against the clock.
Orientation orientation_by_opencv(const cv::VideoCapture& capture) {
  const double degrees = capture.get(cv::CAP_PROP_ORIENTATION_META);
  if (!(degrees > -720 && degrees < 720)) return {};
  const int turns = static_cast<int>(std::lround(degrees / 90));
  const bool clockwise = cv::getVersionMajor() * 100 + cv::getVersionMinor() >= 407;
  return {false, ((clockwise ? turns : -turns) % 4 + 4) % 4};
}

void turn_upright(cv::Mat& image, const Orientation& orientation) {
  constexpr int kLeftToRight = 1;
  constexpr std::array kTurns{cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180,
                              cv::ROTATE_90_COUNTERCLOCKWISE};
  if (orientation.mirrored) cv::flip(image, image, kLeftToRight);
  const int turns = orientation.quarter_turns;
  if (turns == 0) return;
  cv::Mat turned;
  cv::rotate(image, turned, kTurns[turns - 1]);
  image = turned;
}

class Video : public FrameSource {
 public:
  enum class Kind { file, stream, camera };

  Video(const std::string& name, Kind kind, std::unique_ptr<cv::VideoCapture> capture)
      : name_(display_name(name)), kind_(kind), capture_(std::move(capture)) {
    if (kind == Kind::camera) return;
    capture_->set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
    const auto stated = kind == Kind::file ? read_display_matrix(name) : std::nullopt;
    orientation_ = stated ? *stated : orientation_by_opencv(*capture_);
  }

  bool next(Frame& frame, bool decode) override {
    if (!capture_->grab()) return false;
    frame.number = ++number_;
    tell_time(frame.when);
    frame.problem.clear();
    frame.image = {};
    if (!decode) return true;
    cv::Mat image;
    if (capture_->retrieve(image) && !image.empty()) {
      turn_upright(image, orientation_);
      frame.image = to_image(image);
    } else {
      frame.problem = fmt::format("{}: frame {} cannot be decoded", name_, number_);
    }
    return true;
  }
  int frame_count() const override {
    const double count = kind_ == Kind::camera ? 0 : capture_->get(cv::CAP_PROP_FRAME_COUNT);
    return count > 0 && count < 1e9 ? static_cast<int>(count) : 0;
  }
  double frame_rate() const override {
    const double rate = capture_->get(cv::CAP_PROP_FPS);
    return rate >= kLowestFrameRate && rate <= kHighestFrameRate ? rate : 0;
  }
  image::PictureSize picture() const override {
    if (kind_ == Kind::file) return {};
    const auto pixels = [this](int property) { return static_cast<int>(capture_->get(property)); };
    const int width = pixels(cv::CAP_PROP_FRAME_WIDTH), height = pixels(cv::CAP_PROP_FRAME_HEIGHT);
    if (orientation_.quarter_turns % 2 != 0) return {height, width};
    return {width, height};
  }
  bool endless() const override {
    return kind_ == Kind::camera || (kind_ == Kind::stream && frame_count() == 0);
  }
  bool repeatable() const override { return kind_ == Kind::file; }

 private:
  // What the container says of the frame grabbed; where that is nothing, one after the last.
  void tell_time(FrameTime& when) {
    if (kind_ != Kind::file) return;
    const double stated = capture_->get(cv::CAP_PROP_POS_MSEC) / 1000;
    if (number_ == 1) {
      begin_ = stated;
      time_ = 0;
    } else if (stated - begin_ > time_) {
      time_ = stated - begin_;
    } else if (frame_rate() > 0) {
      time_ += 1 / frame_rate();
    } else {
      return;
    }
    when.time = time_;
  }

  std::string name_;
  Kind kind_;
  std::unique_ptr<cv::VideoCapture> capture_;
  Orientation orientation_;
  int number_ = 0;
  double begin_ = 0;  // of the container's clock, seconds
  double time_ = 0;   // of the last frame
};

// The first bytes of a file say what FFmpeg would play although nobody calls it a video.
std::optional<std::string> other_than_video(const std::string& name) {
  std::string start(4096, '\0');
  std::ifstream file(name, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  if (start.empty()) return "is empty";
  const auto starts = [&](std::string_view text) { return start.starts_with(text); };
  if (starts("\xFF\xD8") || starts("\x89PNG") || starts("BM") || starts("II*") ||
      starts(std::string_view("MM\0*", 4)) ||
      (starts("RIFF") && std::string_view(start).substr(8, 4) == "WEBP")) {
    return "is a single picture, expected a video or a folder of pictures";
  }
  if (starts("ID3") || starts("fLaC") ||
      std::string_view(start)
          .substr(std::min<std::size_t>(4, start.size()))
          .starts_with("ftypM4A")) {
    return "is sound, whatever picture is on its cover; expected a video";
  }
  if (starts("#EXTM3U") || starts("ffconcat") || starts("v=0")) return {};  // lists of videos
  const bool text = std::none_of(start.begin(), start.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 && std::isspace(byte) == 0 && byte != 0x1B;
  });
  if (text) return "is a text, not a video";
  return {};
}

}  // namespace

std::unique_ptr<FrameSource> open_video_file(const std::string& file) {
  if (const auto other = other_than_video(file)) throw std::invalid_argument(file + ": " + *other);
  auto capture = capture_with_ffmpeg(file);
  // What FFmpeg makes pictures of although it is text: the codec of terminals' codes.
  const bool terminal =
      capture->isOpened() && capture->get(cv::CAP_PROP_FOURCC) == codec_code("ansi");
  if (!capture->isOpened() || terminal) {
    throw std::invalid_argument(file + ": is not a video that can be decoded");
  }
  return std::make_unique<Video>(file, Video::Kind::file, std::move(capture));
}

std::unique_ptr<FrameSource> open_stream(const std::string& url) {
  auto capture = capture_with_ffmpeg(url);
  if (!capture->isOpened()) throw std::runtime_error(display_name(url) + ": cannot be opened");
  return std::make_unique<Video>(url, Video::Kind::stream, std::move(capture));
}

std::unique_ptr<FrameSource> open_camera(const std::string& input) {
  constexpr std::string_view kCamera = "camera:";
  const std::string digits = input.substr(kCamera.size());
  if (digits.empty() || digits.size() > 3 ||
      !std::all_of(digits.begin(), digits.end(),
                   [](unsigned char c) { return std::isdigit(c) != 0; })) {
    throw std::invalid_argument(input + ": expected camera:N with N from 0 to 999");
  }
  auto capture = capture_camera(std::stoi(digits));
  if (!capture->isOpened()) throw std::runtime_error(input + ": cannot be opened");
  return std::make_unique<Video>(input, Video::Kind::camera, std::move(capture));
}

}  // namespace sdmt::pipeline
