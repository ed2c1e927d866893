// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <opencv2/core.hpp>

#include "sdmt/track/finished_frame.h"

namespace sdmt::pipeline {

/// Draws finished frames: a box and a number for each person in a colour of its own that never
/// changes, and the trail of where its feet were. Detected boxes have a full line, boosted ones
/// dashes, interpolated ones dots.
class TrackRenderer {
 public:
  /// Draws into `image`, the frame itself. To be called for every frame in order.
  void draw(const track::FinishedFrame& frame, cv::Mat& image);

 private:
  struct Trail {
    std::deque<cv::Point2d> feet;
    int last_frame = 0;
  };
  void remember(const track::FinishedFrame& frame);

  std::map<int, Trail> trails_;  // by id
};

/// The colour (BGR) that an id is drawn in everywhere: hues a golden ratio of the circle apart, so
/// that neighbouring ids differ most.
cv::Scalar track_colour(int id);

}  // namespace sdmt::pipeline
