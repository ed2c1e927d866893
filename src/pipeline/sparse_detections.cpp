// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/sparse_detections.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::pipeline {

namespace {

constexpr int kStep = 4;                            // between the pixels that are read
constexpr int kBlock = 4;                           // of these along each side of a block
constexpr int kChange = 10;                         // of 255
constexpr int kFirstRest = 50, kLongestRest = 200;  // frames

}  // namespace

bool MotionGate::moved(const image::Image& image) {
  const int columns = image.width / kStep, rows = image.height / kStep;
  comparable_ = image.width == width_ && image.height == height_ && !remembered_.empty();
  width_ = image.width;
  height_ = image.height;
  seen_.resize(static_cast<std::size_t>(columns) * rows);
  auto* to = seen_.data();
  for (int y = 0; y < rows; ++y) {
    const auto* pixel = image.bgr.data() + static_cast<std::size_t>(y) * kStep * image.width * 3;
    for (int x = 0; x < columns; ++x, pixel += 3 * kStep) {
      *to++ = static_cast<std::uint8_t>((pixel[0] + 2 * pixel[1] + pixel[2]) / 4);
    }
  }
  if (!comparable_) return true;
  for (int top = 0; top < rows; top += kBlock) {
    for (int left = 0; left < columns; left += kBlock) {
      int sum = 0, count = 0;
      for (int y = top; y < std::min(top + kBlock, rows); ++y) {
        for (int x = left; x < std::min(left + kBlock, columns); ++x, ++count) {
          const std::size_t i = static_cast<std::size_t>(y) * columns + x;
          sum += std::abs(seen_[i] - remembered_[i]);
        }
      }
      if (sum > kChange * count) return true;
    }
  }
  return false;
}

SparseDetections::SparseDetections(std::unique_ptr<DetectionSource> detector, int interval)
    : detector_(std::move(detector)), interval_(interval) {
  io::require_in("detect_every", interval, 1, 100);
}

std::vector<mot::Detection> SparseDetections::detect(const Frame& frame) {
  looks_ = false;
  if (!frame.has_image()) return {};
  const bool moved = gate_.moved(frame.image);
  const int since = looked_ == 0 ? kLongestRest : frame.number - looked_;
  if (moved) rest_ = kFirstRest;
  looks_ = moved ? since >= interval_ : true;
  if (!looks_) return {};
  if (!moved) {
    if (since < rest_) return boxes_;
    rest_ = std::min(2 * rest_, kLongestRest);
  }
  boxes_ = detector_->detect(frame);
  looked_ = frame.number;
  gate_.remember();
  return boxes_;
}

}  // namespace sdmt::pipeline
