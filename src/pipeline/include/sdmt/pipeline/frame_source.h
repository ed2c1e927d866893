// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <string>

namespace sdmt::pipeline {

/// One frame of the input. An empty image means: this frame exists but cannot be read (a damaged
/// file), or the sequence comes without frames.
struct Frame {
  int number = 0;       ///< 1-based
  cv::Mat image;        ///< 8-bit BGR
  std::string problem;  ///< why the image is empty, naming file or frame; empty when it just is not
                        ///< there to be read
};

/// What every input offers: its frames, one after the other.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Goes to the next frame; false at the end. A frame that cannot be read does not end the input.
  /// decode = false: only its number is wanted, the image stays empty.
  virtual bool next(Frame& frame, bool decode) = 0;
  /// Frames from the beginning; 0 when not known (a camera, some videos).
  virtual int frame_count() const = 0;
  /// Frames per second; 0 when not known.
  virtual double frame_rate() const = 0;
  /// Whether frames come with images at all; false for a MOT sequence without its img1.
  virtual bool has_images() const { return true; }
  /// Whether it has no end of its own, as a camera: when frames stop coming, it was lost.
  virtual bool endless() const { return false; }
  /// Whether the input can be opened again to see the same frames.
  virtual bool repeatable() const { return true; }
};

/// `input` is a MOTChallenge sequence folder (with seqinfo.ini), a folder of images (in natural
/// order: 2.jpg before 10.jpg), a video file, "camera:N", or a stream's URL (rtsp://, http://,
/// ...). Throws std::invalid_argument when there is no such input or it holds no frames,
/// std::runtime_error when a camera or stream does not answer.
std::unique_ptr<FrameSource> open_frame_source(const std::string& input);

}  // namespace sdmt::pipeline
