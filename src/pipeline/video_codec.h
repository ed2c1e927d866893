// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/videoio.hpp>
#include <string>
#include <string_view>

// OpenCV's readers and writers of videos, whose library brings two hundred others. What they are
// made by has a file of its own, all else goes through their virtual functions, so that a program
// can put others here, which load the library when it is needed; the binary does (tools/codecs).
namespace sdmt::pipeline {

/// Opens a file or URL by FFmpeg alone: other decoders of OpenCV may wait for ever for what they
/// cannot decode. Opening and each frame take 10 seconds at most. Not open where that failed.
std::unique_ptr<cv::VideoCapture> capture_with_ffmpeg(const std::string& name);

/// A camera of Video4Linux.
std::unique_ptr<cv::VideoCapture> capture_camera(int number);

/// A codec's name of four characters as OpenCV takes it.
constexpr int codec_code(std::string_view name) {
  return name[0] | name[1] << 8 | name[2] << 16 | name[3] << 24;
}

/// A video by FFmpeg. Not open where that failed.
std::unique_ptr<cv::VideoWriter> write_with_ffmpeg(const std::string& file, int codec,
                                                   double frame_rate, cv::Size size);

}  // namespace sdmt::pipeline
