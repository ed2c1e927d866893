// SPDX-License-Identifier: Apache-2.0
#include "video_codec.h"

#include <vector>

namespace sdmt::pipeline {

std::unique_ptr<cv::VideoCapture> capture_with_ffmpeg(const std::string& name) {
  constexpr int kTimeoutMs = 10000;
  const std::vector<int> timeouts{cv::CAP_PROP_OPEN_TIMEOUT_MSEC, kTimeoutMs,
                                  cv::CAP_PROP_READ_TIMEOUT_MSEC, kTimeoutMs};
  return std::make_unique<cv::VideoCapture>(name, cv::CAP_FFMPEG, timeouts);
}

std::unique_ptr<cv::VideoCapture> capture_camera(int number) {
  return std::make_unique<cv::VideoCapture>(number, cv::CAP_V4L2);
}

std::unique_ptr<cv::VideoWriter> write_with_ffmpeg(const std::string& file, int codec,
                                                   double frame_rate, cv::Size size) {
  return std::make_unique<cv::VideoWriter>(file, cv::CAP_FFMPEG, codec, frame_rate, size);
}

}  // namespace sdmt::pipeline
