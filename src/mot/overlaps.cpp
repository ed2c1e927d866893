// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/overlaps.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace sdmt::mot {

const std::vector<Overlap>& OverlapFinder::find(std::span<const Tlwh> a, std::span<const Tlwh> b,
                                                double min_iou) {
  found_.clear();
  by_left_.clear();
  double widest = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    by_left_.push_back({b[i].left, static_cast<int>(i)});
    widest = std::max(widest, b[i].width);
  }
  const auto before = [](const Edge& x, const Edge& y) {
    return x.left < y.left || (x.left == y.left && x.index < y.index);
  };
  std::sort(by_left_.begin(), by_left_.end(), before);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto first = found_.size();
    const double left = a[i].left - widest;
    const double right = a[i].left + a[i].width;
    auto edge = std::lower_bound(by_left_.begin(), by_left_.end(), left,
                                 [](const Edge& x, double value) { return x.left < value; });
    for (; edge != by_left_.end() && edge->left < right; ++edge) {
      const double overlap = iou(a[i], b[edge->index]);
      if (overlap > min_iou) found_.push_back({static_cast<int>(i), edge->index, overlap});
    }
    std::sort(found_.begin() + static_cast<std::ptrdiff_t>(first), found_.end(),
              [](const Overlap& x, const Overlap& y) { return x.b < y.b; });
  }
  return found_;
}

void suppress_overlaps(std::span<const Tlwh> boxes, std::span<const double> scores, double max_iou,
                       OverlapFinder& finder, std::vector<std::uint8_t>& keep) {
  keep.assign(boxes.size(), 1);
  if (max_iou >= 1) return;
  const auto& overlaps = finder.find(boxes, boxes, max_iou);
  if (std::all_of(overlaps.begin(), overlaps.end(), [](const Overlap& x) { return x.a == x.b; })) {
    return;
  }
  std::vector<int> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int x, int y) { return scores[x] > scores[y]; });
  for (const int best : order) {
    if (!keep[best]) continue;
    auto pair = std::lower_bound(overlaps.begin(), overlaps.end(), best,
                                 [](const Overlap& x, int index) { return x.a < index; });
    for (; pair != overlaps.end() && pair->a == best; ++pair) {
      if (pair->b != best) keep[pair->b] = 0;
    }
  }
}

}  // namespace sdmt::mot
