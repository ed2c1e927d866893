// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "sdmt/track/mot_file.h"
#include "tracking/detection_source.h"

namespace sdmt::tools {

/// Detections that somebody else made.
class FileDetections : public DetectionSource {
 public:
  explicit FileDetections(track::DetectionFile file) : file_(std::move(file)) {}

  std::vector<track::Detection> detect(const Frame& frame) override {
    const auto boxes = file_.frame(frame.number);
    return {boxes.begin(), boxes.end()};
  }
  int last_frame() const override { return file_.last_frame(); }

 private:
  track::DetectionFile file_;
};

}  // namespace sdmt::tools
