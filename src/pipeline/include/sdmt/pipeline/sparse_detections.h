// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sdmt/pipeline/detection_source.h"

namespace sdmt::pipeline {

/// Whether anything has moved between two images: in one of the blocks of 16 x 16 pixels, of which
/// every fourth pixel along x and y is read, the mean change of brightness exceeds 10 of 255. Blind
/// to what moves by less: people of some 20 pixels, those who stand, slow changes of the light.
class MotionGate {
 public:
  /// Whether anything has moved since the image that was remembered last.
  bool moved(const image::Image& image);
  /// The image given to moved() last is the one to compare with from now on.
  void remember() { remembered_ = seen_; }

 private:
  int width_ = 0, height_ = 0;  // of the image given last
  bool comparable_ = false;
  std::vector<std::uint8_t> seen_, remembered_;  // brightness, every fourth pixel
};

/// Looks with a detector now and then. In a frame in which nothing has moved since the last look,
/// the boxes are those of that look, for at most 50 frames on end, and where the next look finds
/// nothing moved either for twice as many, up to 200. Where something has moved, it looks at most
/// every `interval` frames, and at the frames between nobody looks: there the tracker predicts.
class SparseDetections : public DetectionSource {
 public:
  /// Throws std::invalid_argument unless interval is in 1..100.
  SparseDetections(std::unique_ptr<DetectionSource> detector, int interval);

  std::vector<mot::Detection> detect(const Frame& frame) override;
  bool needs_images() const override { return true; }
  bool looked() const override { return looks_; }

 private:
  std::unique_ptr<DetectionSource> detector_;
  int interval_;
  int looked_ = 0;  // the frame of the last look, 0 before the first
  int rest_ = 0;    // until the next where nothing moves
  bool looks_ = true;
  std::vector<mot::Detection> boxes_;
  MotionGate gate_;
};

}  // namespace sdmt::pipeline
