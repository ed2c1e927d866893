// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_replay.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace sdmt::pipeline {

FrameReplay::FrameReplay(const std::string& input, const FrameSource& source) {
  if (source.repeatable()) second_ = open_frame_source(input);
}

void FrameReplay::add(const Frame& frame) {
  if (second_ != nullptr) return;
  std::vector<std::uint8_t>& jpeg = kept_.emplace_back();
  if (!frame.image.empty()) cv::imencode(".jpg", frame.image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 92});
}

cv::Mat FrameReplay::next() {
  cv::Mat image;
  if (second_ != nullptr) {
    Frame frame;
    second_->next(frame, true);
    image = frame.image;
  } else if (!kept_.empty()) {
    if (!kept_.front().empty()) image = cv::imdecode(kept_.front(), cv::IMREAD_COLOR);
    kept_.pop_front();
  }
  if (image.empty()) return {size_, CV_8UC3, cv::Scalar::all(96)};
  size_ = image.size();
  return image;
}

}  // namespace sdmt::pipeline
