// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "sdmt/mot/sequence.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCamera = "camera:";

// Every digit run padded to one length, so that comparing texts compares the numbers in them.
std::string natural_key(const std::string& name) {
  constexpr std::size_t kDigits = 20;
  std::string key;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i;
    while (end < name.size() && std::isdigit(static_cast<unsigned char>(name[end])) != 0) ++end;
    if (end > i) {
      key.append(kDigits - std::min(kDigits, end - i), '0');
      key.append(name, i, end - i);
      i = end;
    } else {
      key += name[i++];
    }
  }
  return key;
}

std::vector<fs::path> images_of(const fs::path& folder) {
  static const std::set<std::string> kExtensions{".jpg", ".jpeg", ".png", ".bmp",
                                                 ".ppm", ".tif",  ".tiff"};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (kExtensions.contains(extension) && entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const auto key_a = natural_key(a.filename().string());
    const auto key_b = natural_key(b.filename().string());
    return key_a != key_b ? key_a < key_b : a < b;
  });
  return files;
}

// Reads an image of a folder; says in the frame why it could not.
void read_image(const fs::path& file, bool decode, Frame& frame) {
  frame.problem.clear();
  frame.image = cv::Mat();  // a fresh one: the caller may still hold the last
  if (!decode) return;
  try {
    frame.image = cv::imread(file.string(), cv::IMREAD_COLOR);
  } catch (const cv::Exception& error) {
    frame.image.release();
    frame.problem = file.string() + ": " + error.err;
    return;
  }
  std::error_code ignored;
  if (frame.image.empty()) {
    frame.problem = file.string() +
                    (fs::exists(file, ignored) ? ": is not a readable image" : ": does not exist");
  }
}

class ImageFolder : public FrameSource {
 public:
  explicit ImageFolder(const std::string& folder) : files_(images_of(folder)) {
    if (files_.empty()) {
      throw std::invalid_argument(folder +
                                  ": holds neither seqinfo.ini nor images (jpg, png, ...)");
    }
    if (files_.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
      throw std::invalid_argument(folder + ": too many images");
    }
  }

  bool next(Frame& frame, bool decode) override {
    if (next_ == files_.size()) return false;
    read_image(files_[next_], decode, frame);
    frame.number = static_cast<int>(++next_);
    return true;
  }
  int frame_count() const override { return static_cast<int>(files_.size()); }
  double frame_rate() const override { return 0; }

 private:
  std::vector<fs::path> files_;
  std::size_t next_ = 0;
};

class MotSequence : public FrameSource {
 public:
  explicit MotSequence(const std::string& folder)
      : sequence_(mot::Sequence::read(folder)), has_images_(sequence_.has_images()) {
    if (sequence_.length > 0) return;
    std::error_code ignored;
    while (fs::exists(sequence_.image(sequence_.length + 1), ignored)) ++sequence_.length;
    if (sequence_.length == 0) {
      throw std::invalid_argument((fs::path(folder) / "seqinfo.ini").string() +
                                  ": seqLength is missing and there are no frames to count");
    }
  }

  bool next(Frame& frame, bool decode) override {
    if (last_ == sequence_.length) return false;
    frame.number = ++last_;
    read_image(sequence_.image(last_), decode && has_images_, frame);
    return true;
  }
  int frame_count() const override { return sequence_.length; }
  double frame_rate() const override { return sequence_.frame_rate; }
  bool has_images() const override { return has_images_; }

 private:
  mot::Sequence sequence_;
  bool has_images_;
  int last_ = 0;
};

// Left to itself, OpenCV asks for a camera of that name, too, when no decoder knows the file.
cv::VideoCapture open_video_file(const std::string& file) {
  cv::VideoCapture capture;
  for (const int decoder : {cv::CAP_FFMPEG, cv::CAP_GSTREAMER, cv::CAP_OPENCV_MJPEG}) {
    if (capture.open(file, decoder)) break;
  }
  return capture;
}

class Video : public FrameSource {
 public:
  explicit Video(const std::string& file) : name_(file), capture_(open_video_file(file)) {
    if (!capture_.isOpened()) {
      throw std::invalid_argument(file + ": is not a video that can be decoded");
    }
  }
  Video(const std::string& name, const cv::VideoCapture& capture)
      : name_(name), capture_(capture), live_(true) {
    if (!capture_.isOpened()) throw std::runtime_error(name + ": cannot be opened");
  }

  bool next(Frame& frame, bool decode) override {
    if (!capture_.grab()) return false;
    frame.number = ++number_;
    frame.problem.clear();
    frame.image = cv::Mat();
    if (!decode) return true;
    if (!capture_.retrieve(frame.image) || frame.image.empty()) {
      frame.image.release();
      frame.problem = fmt::format("{}: frame {} cannot be decoded", name_, number_);
    }
    return true;
  }
  int frame_count() const override {
    const double count = live_ ? 0 : capture_.get(cv::CAP_PROP_FRAME_COUNT);
    return count > 0 && count < 1e9 ? static_cast<int>(count) : 0;
  }
  double frame_rate() const override {
    const double rate = capture_.get(cv::CAP_PROP_FPS);
    return std::isfinite(rate) && rate > 0 && rate <= 1000 ? rate : 0;
  }
  bool endless() const override { return name_.starts_with(kCamera); }
  bool repeatable() const override { return !live_; }

 private:
  std::string name_;
  cv::VideoCapture capture_;
  bool live_ = false;
  int number_ = 0;
};

int camera_index(const std::string& input) {
  const std::string digits = input.substr(kCamera.size());
  if (digits.empty() || digits.size() > 3 ||
      !std::all_of(digits.begin(), digits.end(),
                   [](unsigned char c) { return std::isdigit(c) != 0; })) {
    throw std::invalid_argument(input + ": expected camera:N with N from 0 to 999");
  }
  return std::stoi(digits);
}

}  // namespace

std::unique_ptr<FrameSource> open_frame_source(const std::string& input) {
  if (input.starts_with(kCamera)) {
    return std::make_unique<Video>(input, cv::VideoCapture(camera_index(input)));
  }
  if (input.find("://") != std::string::npos) {
    return std::make_unique<Video>(input, cv::VideoCapture(input, cv::CAP_FFMPEG));
  }
  std::error_code ignored;
  if (!fs::exists(input, ignored)) throw std::invalid_argument(input + ": does not exist");
  if (mot::Sequence::is_sequence(input)) return std::make_unique<MotSequence>(input);
  if (fs::is_directory(input, ignored)) return std::make_unique<ImageFolder>(input);
  return std::make_unique<Video>(input);
}

}  // namespace sdmt::pipeline
