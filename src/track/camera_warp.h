// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/image/camera_motion.h"
#include "sdmt/mot/box.h"
#include "sdmt/track/kalman_filter.h"

namespace sdmt::track {

/// Where a box that stands still is after the camera moved; it stays upright.
inline mot::Cxcywh warped(const mot::Cxcywh& box, const image::CameraMotion& motion) {
  // Boxes count the first pixel as 1, the pixel plane begins at 0.
  const double x = box.cx - 1, y = box.cy - 1, scale = motion.scale();
  return {motion.a * x - motion.b * y + motion.tx + 1, motion.b * x + motion.a * y + motion.ty + 1,
          scale * box.width, scale * box.height};
}

inline mot::Tlwh warped(const mot::Tlwh& box, const image::CameraMotion& motion) {
  return mot::to_tlwh(warped(mot::to_cxcywh(box), motion));
}

/// The same for a person and what is known of how they move: velocities turn and grow with the
/// picture, variances by the square.
inline KalmanState warped(const KalmanState& state, const image::CameraMotion& motion) {
  const mot::Cxcywh box = warped(state.box(), motion);
  const double scale = motion.scale();
  KalmanState out;
  out.mean = {box.cx, box.cy, box.width, box.height};
  out.velocity = {motion.a * state.velocity[0] - motion.b * state.velocity[1],
                  motion.b * state.velocity[0] + motion.a * state.velocity[1],
                  scale * state.velocity[2], scale * state.velocity[3]};
  out.position_variance = scale * scale * state.position_variance;
  out.covariance = scale * scale * state.covariance;
  out.velocity_variance = scale * scale * state.velocity_variance;
  return out;
}

}  // namespace sdmt::track
