// SPDX-License-Identifier: Apache-2.0
#include "video_segments.h"

#include <fmt/core.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sdmt/pipeline/utc_time.h"
#include "video_encoder.h"

namespace sdmt::pipeline {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// An encoder does not say that it could not write, so it must never be so.
constexpr std::uintmax_t kLeastRoom = 32'000'000;

std::string now() { return utc_text(std::chrono::system_clock::now()); }

}  // namespace

VideoSegments::VideoSegments(const std::string& path, double frame_rate, Flowing flowing)
    : path_(path),
      frame_rate_(frame_rate),
      flowing_(std::move(flowing)),
      retention_(path, flowing_) {
  check_video(path, frame_rate);
  const std::string container = lower_case_extension(path);
  if (container == ".mp4" || container == ".mov") {
    throw std::invalid_argument(path +
                                ": a video of this kind can be played only once it is whole, " +
                                "which that of a camera never is; expected .mkv or .avi");
  }
  if (flowing_.rotation.bytes == 0 && flowing_.rotation.seconds == 0) {
    flowing_.rotation.seconds = kLongest;
  }
}

VideoSegments::~VideoSegments() = default;

void VideoSegments::write(const image::Image& image) {
  retention_.look();
  if (!has_room()) {
    ++missing_;
    return;
  }
  if (encoder_ != nullptr && is_old()) encoder_.reset();
  if (encoder_ == nullptr) {
    segment_ = rotated_name(path_);
    encoder_ = std::make_unique<VideoEncoder>(segment_, segment_, frame_rate_);
    begun_ = Clock::now();
  }
  encoder_->write(image);
}

void VideoSegments::commit() { encoder_.reset(); }

bool VideoSegments::has_room() {
  if (looked_ != Clock::time_point{} && Clock::now() - looked_ < std::chrono::seconds(1)) {
    return !full_;
  }
  looked_ = Clock::now();
  std::error_code failed;
  const auto folder = fs::path(path_).parent_path();
  const auto space = fs::space(folder.empty() ? fs::path(".") : folder, failed);
  const bool full = !failed && space.available < kLeastRoom;
  if (full == full_) return !full_;
  full_ = full;
  if (full) {
    encoder_.reset();
    flowing_.tell(fmt::format("{}: stops, {}: there are less than {} MB of room on the disk", path_,
                              now(), kLeastRoom / 1'000'000));
  } else {
    flowing_.tell(fmt::format("{}: goes on, {}; {} frames are missing", path_, now(),
                              std::exchange(missing_, 0)));
  }
  return !full_;
}

bool VideoSegments::is_old() const {
  std::error_code failed;
  const Rotation& rotation = flowing_.rotation;
  return (rotation.seconds > 0 &&
          Clock::now() - begun_ >= std::chrono::duration<double>(rotation.seconds)) ||
         (rotation.bytes > 0 && fs::file_size(segment_, failed) >= rotation.bytes && !failed);
}

}  // namespace sdmt::pipeline
