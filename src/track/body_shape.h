// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/image/picture_size.h"
#include "sdmt/mot/box.h"

namespace sdmt::track {

/// Which sides of a box the picture's border cuts.
struct CutSides {
  bool left = false, right = false, top = false, bottom = false;

  bool across() const { return left != right; }
  bool along() const { return top != bottom; }
  bool any() const { return left || right || top || bottom; }
};

/// Of a picture of 0 by 0 pixels: none.
CutSides cut_sides(const mot::Tlwh& box, const image::PictureSize& picture);

/// How wide a person is for their height, learned where they are seen whole, to complete their box
/// where the picture's border cuts it.
struct BodyShape {
  static constexpr int kRecent = 25;

  double aspect = 0;  ///< width over height, mean of the last kRecent boxes or so
  int boxes = 0;      ///< seen whole, kRecent at most

  /// A box as it was detected, in its own frame. Of a picture of 0 by 0 nothing is learned.
  void see(const mot::Tlwh& box, const image::PictureSize& picture);

  /// The box, in its own frame, reaching beyond the side of the picture that cuts it as far as the
  /// person does. As it is where nothing or more than one side is cut, and of a person who was
  /// never seen whole.
  mot::Tlwh whole(const mot::Tlwh& box, const image::PictureSize& picture) const;
};

}  // namespace sdmt::track
