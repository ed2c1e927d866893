// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::track {

/// A Kalman filter of one coordinate with constant velocity, a frame being the unit of time. The
/// filters of the baselines are made of these; the defaults are SORT's uncertainty at the start.
struct CoordinateFilter {
  double value;
  double variance = 10;
  double velocity = 0;
  double velocity_variance = 1e4;
  double covariance = 0;  // of value and velocity

  void predict(double process_variance, double velocity_process_variance) {
    value += velocity;
    variance += 2 * covariance + velocity_variance + process_variance;
    covariance += velocity_variance;
    velocity_variance += velocity_process_variance;
  }

  void update(double measured, double measurement_variance) {
    const double innovation_variance = variance + measurement_variance;
    const double gain = variance / innovation_variance;
    const double velocity_gain = covariance / innovation_variance;
    const double innovation = measured - value;
    value += gain * innovation;
    velocity += velocity_gain * innovation;
    // As P - K S K', which is exact for the optimal gain.
    velocity_variance -= velocity_gain * covariance;
    covariance *= 1 - gain;
    variance *= 1 - gain;
  }
};

}  // namespace sdmt::track
