// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/image/patch.h"

namespace sdmt::image {

/// How the picture moved from one frame to the next because the camera did: a point (x, y) of the
/// pixel plane of the earlier frame is at (a x - b y + tx, b x + a y + ty) in the later one; a
/// similarity: shift, zoom and roll.
struct CameraMotion {
  double a = 1, b = 0, tx = 0, ty = 0;

  bool operator==(const CameraMotion&) const = default;
  bool is_still() const { return *this == CameraMotion{}; }
  /// How much larger things become.
  double scale() const;
  CameraMotion inverse() const;
  /// This motion, then `next`.
  CameraMotion then(const CameraMotion& next) const;
};

/// Estimates the motion of the camera from frame to frame on small grey pictures, by the gradients
/// of what stands still (Lucas and Kanade, 1981; inverse compositional after Baker and Matthews,
/// 2004), robust against what moves (Tukey's biweight).
///
/// A motion of less than 0.15 pixels of the small pictures (240 wide) is none, to the last bit, and
/// the frame before stays the one to compare with, so that a slow pan is not lost but comes in
/// steps.
class CameraMotionEstimator {
 public:
  /// The motion since the frame given last; none for the first one. `people`: where people are in
  /// this frame; they are left out when the next one is compared with it. nullopt where it could
  /// not be found: too little to go by, other sizes, a cut.
  std::optional<CameraMotion> next(const ImageView& frame, std::span<const PixelRect> people);

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<float> grey;
  };
  /// What there is to go by in a level of the frame to compare with.
  struct Points {
    std::vector<float> x, y, grey, along_x, along_y;
    float contrast = 0;  // median distance of their grey from the median grey
  };

  void shrink(const ImageView& frame, std::vector<Level>& levels) const;
  void remember(std::span<const PixelRect> people);
  bool align(const Points& points, const Level& level, CameraMotion& motion, bool finest);

  double step_ = 1;  // pixels of a frame to one of the finest level
  int width_ = 0, height_ = 0;
  std::vector<Level> now_, before_;  // finest first
  std::vector<Points> points_;       // of before_
  int age_ = 0;                      // frames since before_
  std::vector<float> errors_, sorted_;
};

}  // namespace sdmt::image
