// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

namespace sdmt::pipeline {

/// Opens a file or URL by FFmpeg alone: other decoders of OpenCV may wait for ever for what they
/// cannot decode. Opening and each frame take 10 seconds at most.
inline cv::VideoCapture open_with_ffmpeg(const std::string& name) {
  constexpr int kTimeoutMs = 10000;
  const std::vector<int> timeouts{cv::CAP_PROP_OPEN_TIMEOUT_MSEC, kTimeoutMs,
                                  cv::CAP_PROP_READ_TIMEOUT_MSEC, kTimeoutMs};
  return cv::VideoCapture(name, cv::CAP_FFMPEG, timeouts);
}

}  // namespace sdmt::pipeline
