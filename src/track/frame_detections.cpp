// SPDX-License-Identifier: Apache-2.0
#include "frame_detections.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace sdmt::track {

namespace {

void check(const mot::Detection& detection, std::size_t index) {
  const auto refuse = [index](const char* field, double value, const char* expected) {
    std::ostringstream message;
    message << "detection " << index << ": " << field << " is " << value << ", expected "
            << expected;
    throw std::invalid_argument(message.str());
  };
  const auto in_range = [](double value) {
    return value >= -mot::kFarthest && value <= mot::kFarthest;
  };
  const mot::Tlwh& box = detection.box;
  if (!in_range(box.left)) refuse("left", box.left, "-1e12..1e12");
  if (!in_range(box.top)) refuse("top", box.top, "-1e12..1e12");
  if (!in_range(box.width) || box.width <= 0) refuse("width", box.width, "> 0 and <= 1e12");
  if (!in_range(box.height) || box.height <= 0) refuse("height", box.height, "> 0 and <= 1e12");
  if (!std::isfinite(detection.score)) refuse("score", detection.score, "a finite number");
}

}  // namespace

void FrameDetections::clear() {
  boxes.clear();
  scores.clear();
  flags.clear();
  features.clear();
}

void FrameDetections::add(const mot::Tlwh& box, double score, const Flags& flag) {
  boxes.push_back(box);
  scores.push_back(score);
  flags.push_back(flag);
}

void FrameDetections::set_feature(std::size_t i, std::span<const float> feature) {
  dimension = static_cast<int>(feature.size());
  features.resize(size() * feature.size());
  std::copy(feature.begin(), feature.end(),
            features.begin() + static_cast<std::ptrdiff_t>(i * feature.size()));
  flags[i].embedded = true;
}

void DetectionFilter::accept(std::span<const mot::Detection> detections,
                             const InputOptions& options, FrameDetections& accepted) {
  boxes_.clear();
  scores_.clear();
  for (std::size_t i = 0; i < detections.size(); ++i) {
    check(detections[i], i);
    const double score = options.probability(detections[i].score);
    if (score < options.min_confidence) continue;
    boxes_.push_back(detections[i].box);
    scores_.push_back(score);
  }
  mot::suppress_overlaps(boxes_, scores_, options.nms, overlaps_, keep_);
  accepted.clear();
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (!keep_[i]) continue;
    FrameDetections::Flags flag;
    flag.strong = scores_[i] >= options.strong_confidence;
    accepted.add(boxes_[i], scores_[i], flag);
  }
}

}  // namespace sdmt::track
