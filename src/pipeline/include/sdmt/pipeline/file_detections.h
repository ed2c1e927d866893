// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "sdmt/mot/mot_file.h"
#include "sdmt/pipeline/detection_source.h"

namespace sdmt::pipeline {

/// Detections that somebody else made.
class FileDetections : public DetectionSource {
 public:
  explicit FileDetections(mot::DetectionFile file) : file_(std::move(file)) {}

  std::vector<mot::Detection> detect(const Frame& frame) override {
    const auto boxes = file_.frame(frame.number);
    return {boxes.begin(), boxes.end()};
  }
  int last_frame() const override { return file_.last_frame(); }

 private:
  mot::DetectionFile file_;
};

}  // namespace sdmt::pipeline
