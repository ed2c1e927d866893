// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// The images of the frames that the tracker finishes, which come some seconds after it saw them.
/// A file is simply read a second time; frames of a camera or stream are kept as JPEG until then.
class FrameReplay {
 public:
  /// `input` as for open_frame_source(); `source` is the one that is being tracked.
  FrameReplay(const std::string& input, const FrameSource& source);

  /// To be called with every frame that is read.
  void add(const Frame& frame);
  /// The image of the next frame, grey where it cannot be read. To be called once a frame, in
  /// order.
  cv::Mat next();

 private:
  std::unique_ptr<FrameSource> second_;         // null for live input
  std::deque<std::vector<std::uint8_t>> kept_;  // JPEG; empty for a frame without an image
  cv::Size size_{640, 480};                     // of the last image
};

}  // namespace sdmt::pipeline
