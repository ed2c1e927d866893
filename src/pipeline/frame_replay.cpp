// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_replay.h"

#include <algorithm>

#include "sdmt/media/image_file.h"

namespace sdmt::pipeline {

namespace {

constexpr int kJpegQuality = 92;
constexpr std::uint8_t kGrey = 96;

}  // namespace

FrameReplay::FrameReplay(const std::string& input, const FrameSource& source) {
  if (source.repeatable()) second_ = open_frame_source(input);
}

void FrameReplay::add(const Frame& frame, bool keep) {
  if (second_ != nullptr) return;
  Kept& kept = kept_.emplace_back();
  kept.number = frame.number;
  if (keep && frame.has_image()) kept.jpeg = media::encode_jpeg(frame.image, kJpegQuality);
}

bool FrameReplay::has_next_image() const {
  return second_ != nullptr || (!kept_.empty() && !kept_.front().jpeg.empty());
}

void FrameReplay::skip() {
  Frame frame;
  if (second_ != nullptr) {
    second_->next(frame, false);
  } else if (!kept_.empty()) {
    kept_.pop_front();
  }
}

Frame FrameReplay::next() {
  Frame frame;
  if (second_ != nullptr) {
    second_->next(frame, true);
  } else if (!kept_.empty()) {
    frame.number = kept_.front().number;
    if (!kept_.front().jpeg.empty()) frame.image = media::decode_image(kept_.front().jpeg);
    kept_.pop_front();
  }
  if (frame.has_image()) {
    width_ = frame.image.width;
    height_ = frame.image.height;
  } else {
    frame.image = image::Image(width_, height_);
    std::fill(frame.image.bgr.begin(), frame.image.bgr.end(), kGrey);
  }
  return frame;
}

}  // namespace sdmt::pipeline
