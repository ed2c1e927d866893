// SPDX-License-Identifier: Apache-2.0
#include "body_shape.h"

#include <algorithm>

namespace sdmt::track {

CutSides cut_sides(const mot::Tlwh& box, const image::PictureSize& picture) {
  if (picture == image::PictureSize{}) return {};
  // Detectors end some pixels short of the border, and smoothing moves what they measured.
  constexpr double kNear = 0.004;
  const double across = kNear * picture.width, along = kNear * picture.height;
  return {box.left - 1 < across, box.left - 1 + box.width > picture.width - across,
          box.top - 1 < along, box.top - 1 + box.height > picture.height - along};
}

void BodyShape::see(const mot::Tlwh& box, const image::PictureSize& picture) {
  constexpr double kSlimmest = 0.01, kWidest = 100;  // beyond: nobody's shape
  const double seen = box.width / box.height;
  if (picture == image::PictureSize{} || cut_sides(box, picture).any()) return;
  if (!(seen > kSlimmest && seen < kWidest)) return;
  boxes = std::min(boxes + 1, kRecent);
  aspect += (seen - aspect) / boxes;
}

mot::Tlwh BodyShape::whole(const mot::Tlwh& box, const image::PictureSize& picture) const {
  const CutSides cut = cut_sides(box, picture);
  if (boxes == 0 || cut.across() == cut.along()) return box;
  mot::Tlwh body = box;
  if (cut.across()) {
    body.width = std::max(box.width, aspect * box.height);
    if (cut.left) body.left -= body.width - box.width;
  } else {
    body.height = std::max(box.height, box.width / aspect);
    if (cut.top) body.top -= body.height - box.height;
  }
  return body;
}

}  // namespace sdmt::track
