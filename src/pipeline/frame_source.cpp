// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_source.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "image_folder.h"
#include "sdmt/mot/sequence.h"
#include "video_source.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;

bool is_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

// What an input that is no file may have been meant to be, in OpenCV's or the shell's words.
std::string guess(const std::string& input) {
  constexpr std::string_view kDevice = "/dev/video";
  if (is_digits(input)) return "; a camera is camera:" + input;
  if (input.starts_with(kDevice) && is_digits(input.substr(kDevice.size()))) {
    return "; a camera is camera:" + input.substr(kDevice.size());
  }
  if (input.find_first_of("%*?") != std::string::npos) {
    const auto folder = fs::path(input).parent_path().string();
    return "; give the folder of the images, " + (folder.empty() ? "." : folder);
  }
  return {};
}

class NumberedFrames : public FrameSource {
 public:
  bool next(Frame& frame, bool) override {
    frame.number = ++number_;
    frame.image = {};
    return true;
  }
  int frame_count() const override { return 0; }
  double frame_rate() const override { return 0; }
  bool has_images() const override { return false; }
  bool endless() const override { return true; }
  bool repeatable() const override { return false; }

 private:
  int number_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> open_frame_source(const std::string& input) {
  if (input == "-") return std::make_unique<NumberedFrames>();
  if (input.starts_with("camera:")) return open_camera(input);
  if (input.find("://") != std::string::npos) return open_stream(input);
  std::error_code failed;
  const auto status = fs::status(input, failed);
  if (!fs::exists(status)) {
    const bool missing = status.type() == fs::file_type::not_found;
    throw std::invalid_argument(input + ": " + (missing ? "does not exist" : failed.message()) +
                                guess(input));
  }
  if (mot::Sequence::is_sequence(input)) return open_mot_sequence(input);
  if (fs::is_directory(status)) return open_image_folder(input);
  if (!fs::is_regular_file(status)) {
    throw std::invalid_argument(input + ": is not a regular file" + guess(input));
  }
  return open_video_file(input);
}

bool is_live(const std::string& input) {
  return input.starts_with("camera:") || input.find("://") != std::string::npos;
}

image::PictureSize picture_size(const std::string& input) {
  if (mot::Sequence::is_sequence(input)) {
    const auto sequence = mot::Sequence::read(input);
    if (sequence.width > 0 && sequence.height > 0) return {sequence.width, sequence.height};
  }
  if (input == "-" || is_live(input)) return {};
  const auto source = open_frame_source(input);
  if (!source->has_images()) return {};
  for (Frame frame; source->next(frame, true);) {
    if (frame.has_image()) return {frame.image.width, frame.image.height};
  }
  return {};
}

image::PictureSize picture_size(const FrameSource& frames, const std::string& input) {
  const image::PictureSize picture = frames.picture();
  return picture.width > 0 ? picture : picture_size(input);
}

}  // namespace sdmt::pipeline
