// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/plausibility.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/track/given_embeddings.h"

namespace sdmt::pipeline {

/// Detections that somebody else made.
class FileDetections : public DetectionSource {
 public:
  /// `path`: where they were read; empty when they never were a file.
  explicit FileDetections(mot::DetectionFile file, std::filesystem::path path = {})
      : file_(std::move(file)), path_(std::move(path)) {}

  std::vector<mot::Detection> detect(const Frame& frame) override {
    const auto boxes = file_.frame(frame.number);
    if (file_.dimension() > 0) embeddings_.set(boxes, file_.embeddings(frame.number));
    time_ = file_.time(frame.number);
    return {boxes.begin(), boxes.end()};
  }
  std::string implausibility(int width, int height) const override {
    return mot::describe_implausible(file_, width, height);
  }
  std::optional<double> time() const override { return time_; }
  int last_frame() const override { return file_.last_frame(); }
  std::filesystem::path file() const override { return path_; }
  std::optional<ScoreRange> score_range() const override;
  image::CropDescriptor* descriptor() override {
    return file_.dimension() > 0 ? &embeddings_ : nullptr;
  }

 private:
  mot::DetectionFile file_;
  std::filesystem::path path_;
  track::GivenEmbeddings embeddings_;
  std::optional<double> time_;
};

}  // namespace sdmt::pipeline
