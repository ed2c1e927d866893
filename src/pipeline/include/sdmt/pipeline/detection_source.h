// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/mot/detection.h"
#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// Where the boxes of a frame come from.
class DetectionSource {
 public:
  virtual ~DetectionSource() = default;

  /// Boxes of one frame, the first pixel counted as 1. Called for every frame in order.
  virtual std::vector<mot::Detection> detect(const Frame& frame) = 0;
  /// The last frame there may be detections for; 0 when not limited.
  virtual int last_frame() const { return 0; }
};

}  // namespace sdmt::pipeline
