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

  /// Whether add() has to see the images.
  bool keeps_images() const { return second_ == nullptr; }
  /// To be called with every frame that is read. `keep`: false where nobody will want its image,
  /// which costs most.
  void add(const Frame& frame, bool keep = true);
  /// Whether the next frame has an image that next() gives; of a file that is not known before.
  bool has_next_image() const;
  /// The next frame, grey where it cannot be read; then `problem` says why. For each frame this or
  /// skip() is to be called, in order.
  Frame next();
  void skip();

 private:
  struct Kept {
    int number;
    std::vector<std::uint8_t> jpeg;  // empty for a frame without an image
  };

  std::unique_ptr<FrameSource> second_;  // null for live input
  std::deque<Kept> kept_;
  int width_ = 640;  // of the last image
  int height_ = 480;
};

}  // namespace sdmt::pipeline
