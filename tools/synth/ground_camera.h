// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

namespace sdmt::tools {

/// A point on the flat ground, metres: x to the right of the camera, z ahead of it.
struct GroundPoint {
  double x = 0;
  double z = 0;
};

/// A pinhole camera above flat ground, looking ahead and down.
class GroundCamera {
 public:
  explicit GroundCamera(cv::Size image);

  cv::Size image() const { return image_; }
  /// Image row of the horizon, pixels.
  double horizon() const;
  /// Where a point at `height` metres above the ground is seen, pixels; z must be > 0.
  cv::Point2d project(const GroundPoint& ground, double height = 0) const;
  /// The ground point seen at a pixel below the horizon.
  GroundPoint ground_at(const cv::Point2d& pixel) const;
  /// The box of something upright, `height` metres tall, `aspect` as wide as high.
  cv::Rect2d upright_box(const GroundPoint& foot, double height, double aspect) const;
  /// How far right of the middle the image reaches at distance z, metres.
  double half_width_at(double z) const;

 private:
  cv::Size image_;
  double focal_;  // pixels
};

}  // namespace sdmt::tools
