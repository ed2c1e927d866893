// SPDX-License-Identifier: Apache-2.0
#include "sdmt/eval/similarities.h"

#include <algorithm>

namespace sdmt::eval {

namespace {

struct Corners {
  double left, top, right, bottom, area;

  explicit Corners(const mot::Tlwh& box)
      : left(box.left), top(box.top), right(box.left + box.width), bottom(box.top + box.height) {
    area = (right - left) * (bottom - top);
  }
};

}  // namespace

std::int64_t SequenceSimilarities::num_gt_dets() const {
  std::int64_t count = 0;
  for (const auto& frame : frames) count += static_cast<std::int64_t>(frame.gt_ids.size());
  return count;
}

std::int64_t SequenceSimilarities::num_result_dets() const {
  std::int64_t count = 0;
  for (const auto& frame : frames) count += static_cast<std::int64_t>(frame.result_ids.size());
  return count;
}

std::vector<BoxPair> overlapping_pairs(std::span<const mot::Tlwh> gt,
                                       std::span<const mot::Tlwh> results) {
  const std::vector<Corners> gt_corners(gt.begin(), gt.end());
  const std::vector<Corners> result_corners(results.begin(), results.end());
  std::vector<BoxPair> found;
  for (std::size_t i = 0; i < gt_corners.size(); ++i) {
    const Corners& a = gt_corners[i];
    if (!(a.area > kSimilaritySlack)) continue;
    for (std::size_t j = 0; j < result_corners.size(); ++j) {
      const Corners& b = result_corners[j];
      const double width = std::min(a.right, b.right) - std::max(a.left, b.left);
      if (!(width > 0)) continue;
      const double height = std::min(a.bottom, b.bottom) - std::max(a.top, b.top);
      if (!(height > 0) || !(b.area > kSimilaritySlack)) continue;
      const double shared = width * height;
      const double similarity = shared / (a.area + b.area - shared);
      if (!(similarity > 0)) continue;  // areas beyond what a double holds
      found.push_back({static_cast<int>(i), static_cast<int>(j), similarity});
    }
  }
  return found;
}

}  // namespace sdmt::eval
