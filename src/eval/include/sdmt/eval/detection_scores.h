// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sdmt/mot/box.h"
#include "sdmt/mot/detection.h"

namespace sdmt::eval {

/// How well boxes find people, whoever tracks them.
struct DetectionScores {
  std::size_t people = 0;  ///< boxes of the ground truth
  std::size_t boxes = 0;   ///< with the least score or more, those on ignored ones left out
  std::size_t found = 0;   ///< people with such a box
  double recall = 0;       ///< found / people; 0 without any
  double precision = 0;    ///< found / boxes; 0 without any
  /// Area under precision over recall for all scores, precision made monotone (PASCAL VOC 2010).
  double average_precision = 0;
};

/// Gathers frames. In each the boxes, the highest score first, take the person with whom they
/// overlap most, by IoU >= 0.5 and one each; a box that finds nobody so and overlaps an ignored
/// box as much does not count.
class DetectionScorer {
 public:
  void add_frame(std::span<const mot::Tlwh> people, std::span<const mot::Tlwh> ignored,
                 std::span<const mot::Detection> detections);
  /// Recall and precision are those of the boxes that score `least_score` or more.
  DetectionScores scores(double least_score) const;

 private:
  struct Box {
    double score;
    bool found;
  };
  std::size_t people_ = 0;
  std::vector<Box> boxes_;
};

}  // namespace sdmt::eval
