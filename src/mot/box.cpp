// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/box.h"

#include <algorithm>

namespace sdmt::mot {

Cxcywh to_cxcywh(const Tlwh& box) {
  return {box.left + box.width / 2, box.top + box.height / 2, box.width, box.height};
}

Tlwh to_tlwh(const Cxcywh& box) {
  return {box.cx - box.width / 2, box.cy - box.height / 2, box.width, box.height};
}

double area(const Tlwh& box) {
  return box.width > 0 && box.height > 0 ? box.width * box.height : 0.0;
}

double iou(const Tlwh& a, const Tlwh& b) {
  const double width = std::min(a.left + a.width, b.left + b.width) - std::max(a.left, b.left);
  const double height = std::min(a.top + a.height, b.top + b.height) - std::max(a.top, b.top);
  if (!(width > 0) || !(height > 0)) return 0.0;
  const double shared = width * height;
  return shared / (area(a) + area(b) - shared);
}

}  // namespace sdmt::mot
