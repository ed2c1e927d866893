// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdmt/mot/box.h"

namespace sdmt::mot {

struct Overlap {
  int a = 0;
  int b = 0;
  double iou = 0;
};

/// Finds the pairs of boxes that overlap, one of each set, without looking at all of them: boxes
/// are sorted by their left edge, and only those that share columns are compared. Keeps its memory.
class OverlapFinder {
 public:
  /// All pairs with IoU strictly above `min_iou` >= 0, ordered by a, then b. The reference holds
  /// until the next call.
  const std::vector<Overlap>& find(std::span<const Tlwh> a, std::span<const Tlwh> b,
                                   double min_iou);

 private:
  struct Edge {
    double left;
    int index;
  };
  std::vector<Edge> by_left_;
  std::vector<Overlap> found_;
};

/// Greedy non-maximum suppression: boxes in order of falling score (ties: in the order given)
/// survive unless they overlap a survivor by an IoU strictly above `max_iou`. keep[i] is 1 for
/// survivors.
void suppress_overlaps(std::span<const Tlwh> boxes, std::span<const double> scores, double max_iou,
                       OverlapFinder& finder, std::vector<std::uint8_t>& keep);

}  // namespace sdmt::mot
