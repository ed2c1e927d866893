// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/kalman_filter.h"

#include <algorithm>
#include <cstddef>

namespace sdmt::track {

namespace {

constexpr std::size_t kSize = 4;

double square(double x) { return x * x; }

double scale(const KalmanState& state) {
  return std::max(state.mean[3], KalmanFilter::kMinimumSize);
}

// Variance of the velocity when the position is known; rounding must not make it negative.
double conditional_variance(const KalmanState& state) {
  constexpr double kRounding = 1e-12;
  return std::max(state.velocity_variance - square(state.covariance) / state.position_variance,
                  kRounding * state.velocity_variance);
}

}  // namespace

KalmanState KalmanFilter::start(const mot::Cxcywh& box) const {
  KalmanState state;
  state.mean = {box.cx, box.cy, box.width, box.height};
  state.position_variance = square(scale(state) * noise_.initial_position);
  state.velocity_variance = square(scale(state) * noise_.initial_velocity);
  return state;
}

KalmanState KalmanFilter::predict(const KalmanState& state, int frames) const {
  const double n = frames;
  const double q = square(scale(state) * noise_.position);
  const double r = square(scale(state) * noise_.velocity);
  KalmanState next = state;
  for (std::size_t i = 0; i < kSize; ++i) next.mean[i] += n * state.velocity[i];
  next.mean[2] = std::max(next.mean[2], kMinimumSize);
  next.mean[3] = std::max(next.mean[3], kMinimumSize);
  // F^n P F^n' plus the noise of the n steps, each carried on by the steps after it: the sums of
  // 0..n-1 and of their squares.
  next.position_variance += n * (2 * state.covariance + n * state.velocity_variance) + n * q +
                            r * (n - 1) * n * (2 * n - 1) / 6;
  next.covariance += n * state.velocity_variance + r * n * (n - 1) / 2;
  next.velocity_variance += n * r;
  return next;
}

KalmanState KalmanFilter::update(const KalmanState& state, const mot::Cxcywh& box,
                                 double looseness) const {
  const double r = square(scale(state) * noise_.measurement * looseness);
  const double innovation = state.position_variance + r;
  const double k = state.position_variance / innovation;
  const double g = state.covariance / innovation;
  const std::array<double, kSize> seen = {box.cx, box.cy, box.width, box.height};
  KalmanState next;
  for (std::size_t i = 0; i < kSize; ++i) {
    const double error = seen[i] - state.mean[i];
    next.mean[i] = state.mean[i] + k * error;
    next.velocity[i] = state.velocity[i] + g * error;
  }
  // (I - K H) P (I - K H)' + K R K' of the Joseph form, which for the optimal gain is a sum of
  // terms that cannot be negative.
  const double p = state.position_variance;
  const double kept = r / innovation;
  next.position_variance = p * kept;
  next.covariance = state.covariance * kept;
  next.velocity_variance = conditional_variance(state) + square(state.covariance) / p * kept;
  return next;
}

SmootherGain KalmanFilter::smoother_gain(const KalmanState& state, int frames) const {
  const KalmanState predicted = predict(state, frames);
  const double determinant = predicted.position_variance * conditional_variance(predicted);
  // P F' Pp^-1; F' takes (position, velocity) covariances n frames on.
  const double n = frames;
  const double pp = state.position_variance + n * state.covariance;
  const double pv = state.covariance;
  const double vp = state.covariance + n * state.velocity_variance;
  const double vv = state.velocity_variance;
  const double a = predicted.velocity_variance / determinant;
  const double b = -predicted.covariance / determinant;
  const double c = predicted.position_variance / determinant;
  return {pp * a + pv * b, pp * b + pv * c, vp * a + vv * b, vp * b + vv * c};
}

KalmanState smooth(const KalmanState& state, int frames, const SmootherGain& gain,
                   const KalmanState& later) {
  KalmanState smoothed = state;
  for (std::size_t i = 0; i < kSize; ++i) {
    const double position = later.mean[i] - (state.mean[i] + frames * state.velocity[i]);
    const double velocity = later.velocity[i] - state.velocity[i];
    smoothed.mean[i] += gain.position_by_position * position + gain.position_by_velocity * velocity;
    smoothed.velocity[i] +=
        gain.velocity_by_position * position + gain.velocity_by_velocity * velocity;
  }
  return smoothed;
}

mot::Cxcywh extrapolate(const KalmanState& state, int frames) {
  mot::Cxcywh box = state.box();
  box.cx += frames * state.velocity[0];
  box.cy += frames * state.velocity[1];
  return box;
}

}  // namespace sdmt::track
