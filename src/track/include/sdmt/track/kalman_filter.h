// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "sdmt/mot/box.h"

namespace sdmt::track {

/// Estimate of a box and its velocity (pixels a frame). Centre and size are four independent
/// constant-velocity filters, and because all noise is proportional to the height of the box, they
/// share one 2 x 2 covariance of position and velocity.
struct KalmanState {
  std::array<double, 4> mean{};      ///< cx, cy, width, height
  std::array<double, 4> velocity{};  ///< of the same
  double position_variance = 0;
  double covariance = 0;  ///< between position and velocity
  double velocity_variance = 0;

  mot::Cxcywh box() const { return {mean[0], mean[1], mean[2], mean[3]}; }
};

/// Gain of one step of the Rauch-Tung-Striebel smoother.
struct SmootherGain {
  double position_by_position = 0, position_by_velocity = 0;
  double velocity_by_position = 0, velocity_by_velocity = 0;
};

/// Standard deviations in units of the box height (section III-D of the paper names a constant
/// velocity filter; state and proportional noise are DeepSORT's, with width instead of aspect
/// ratio, which a box without height cannot divide by zero).
class KalmanFilter {
 public:
  struct Noise {
    double measurement = 1.0 / 20;
    double position = 1.0 / 20;   ///< added by each frame
    double velocity = 1.0 / 160;  ///< added by each frame
    double initial_position = 2.0 / 20;
    double initial_velocity = 10.0 / 160;
  };

  /// Smallest width and height of a prediction, and of the height that scales the noise, in pixels.
  static constexpr double kMinimumSize = 2;

  explicit KalmanFilter(const Noise& noise) : noise_(noise) {}

  KalmanState start(const mot::Cxcywh& box) const;
  /// The state `frames` >= 0 frames later.
  KalmanState predict(const KalmanState& state, int frames = 1) const;
  /// The state after seeing `box`, whose noise is `looseness` > 0 times that of measurements. The
  /// covariance stays positive definite (Joseph form).
  KalmanState update(const KalmanState& state, const mot::Cxcywh& box, double looseness = 1) const;
  /// How much of a surprise `frames` after `state` goes back into it.
  SmootherGain smoother_gain(const KalmanState& state, int frames) const;

 private:
  Noise noise_;
};

/// One step of the Rauch-Tung-Striebel smoother: mean and velocity of `state` improved by knowing
/// what they turned out to be `frames` later. The variances stay those of `state`.
KalmanState smooth(const KalmanState& state, int frames, const SmootherGain& gain,
                   const KalmanState& later);

/// The box `frames` later (or earlier, below 0) with constant velocity of the centre and the size
/// as it is: a size velocity kept over 90 frames explodes or turns negative.
mot::Cxcywh extrapolate(const KalmanState& state, int frames);

}  // namespace sdmt::track
