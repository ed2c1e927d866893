// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sdmt/mot/box.h"

namespace sdmt::pipeline {

/// One output of a network.
struct HeadOutput {
  std::vector<int> shape;
  const float* values = nullptr;
  bool region = false;  ///< of a Darknet region or yolo layer as OpenCV computes it
};

/// A box that a network proposes, in pixels of its input from 0, with the best of the wanted
/// classes.
struct Candidate {
  mot::Cxcywh box;
  double score = 0;
};

/// Pixels as a network was trained on them: (value - mean) * factor for values 0..255, by channel
/// in the order of the input.
struct InputPixels {
  bool rgb = false;
  std::array<float, 3> mean{};
  std::array<float, 3> factor{1, 1, 1};
};

/// What the outputs of a detector mean. Known are
///   region            Darknet: rows of cx, cy, width, height (0..1), objectness, classes
///   YOLOX             [1, cells, 5 + classes], offsets within cells of 8, 16 and 32 pixels, or
///                     boxes where they were decoded before the export
///   YOLOv5, v7        [1, 3 cells, 5 + classes], boxes in pixels
///   YOLOv8, v9, 11    [1, 4 + classes, cells], boxes in pixels, no objectness
///   YOLOv10           [1, boxes, 6], two corners in pixels, score, class
///   NanoDet           for cells of 8, 16 and 32 pixels [1, cells, classes] and [1, cells, 32]:
///                     distributions of the distances to the four sides; NanoDet-Plus: all in one,
///                     and cells of 64
///   DetectionOutput   SSD: [1, 1, boxes, 7] image, class, score, two corners (0..1)
class DetectionHead {
 public:
  /// nullopt for outputs of another kind. `outputs` are those of one plain grey input of
  /// `width` x `height`, which tells offsets from boxes.
  static std::optional<DetectionHead> recognise(std::span<const HeadOutput> outputs, int width,
                                                int height);

  std::string_view name() const;
  /// Classes it tells apart; 0 where the outputs do not say.
  int classes() const { return classes_; }
  const InputPixels& pixels() const { return pixels_; }

  /// Appends the boxes that score at least `min_score` in one of the `wanted` classes (by number;
  /// a number beyond its end is not wanted). False when the shapes are not those of an input of
  /// this size.
  bool decode(std::span<const HeadOutput> outputs, int width, int height,
              std::span<const std::uint8_t> wanted, double min_score,
              std::vector<Candidate>& out) const;

 private:
  enum class Kind {
    region,
    yolox,
    yolox_boxes,
    yolov5,
    yolov8,
    yolov10,
    nanodet,
    nanodet_plus,
    ssd
  };
  DetectionHead(Kind kind, int classes);

  Kind kind_;
  int classes_;
  InputPixels pixels_;
};

}  // namespace sdmt::pipeline
