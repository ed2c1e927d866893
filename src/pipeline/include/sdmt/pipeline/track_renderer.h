// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <map>

#include "sdmt/image/image.h"
#include "sdmt/track/finished_frame.h"

namespace sdmt::pipeline {

/// Draws finished frames: a box and a number for each person in a colour of its own that never
/// changes, and the trail of where its feet were. Detected boxes have a full line, boosted ones
/// dashes, interpolated ones dots.
class TrackRenderer {
 public:
  /// Draws into `image`, the frame itself. For each frame this or skip() is to be called, in order.
  void draw(const track::FinishedFrame& frame, image::Image& image);
  /// Remembers where people were, for the trails of the frames that follow.
  void skip(const track::FinishedFrame& frame);

 private:
  struct Trail {
    std::deque<std::array<double, 2>> feet;  // x and y, the oldest first
    int last_frame = 0;
  };

  std::map<int, Trail> trails_;  // by id
};

}  // namespace sdmt::pipeline
