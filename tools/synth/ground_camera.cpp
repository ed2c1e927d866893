// SPDX-License-Identifier: Apache-2.0
#include "synth/ground_camera.h"

#include <cmath>

namespace sdmt::tools {

namespace {

constexpr double kHeight = 4.2;       // metres above the ground
const double kSine = std::sin(0.22);  // of the tilt, radians down from level
const double kCosine = std::cos(0.22);

}  // namespace

GroundCamera::GroundCamera(cv::Size image) : image_(image), focal_(1.05 * image.width) {}

double GroundCamera::horizon() const { return image_.height / 2.0 - focal_ * kSine / kCosine; }

cv::Point2d GroundCamera::project(const GroundPoint& ground, double height) const {
  const double below = kHeight - height;
  const double depth = kCosine * ground.z + kSine * below;
  const double down = kCosine * below - kSine * ground.z;
  return {image_.width / 2.0 + focal_ * ground.x / depth,
          image_.height / 2.0 + focal_ * down / depth};
}

GroundPoint GroundCamera::ground_at(const cv::Point2d& pixel) const {
  const double right = (pixel.x - image_.width / 2.0) / focal_;
  const double down = (pixel.y - image_.height / 2.0) / focal_;
  const double scale = kHeight / (kSine + kCosine * down);  // the ray's length to the ground
  return {right * scale, (kCosine - kSine * down) * scale};
}

cv::Rect2d GroundCamera::upright_box(const GroundPoint& foot, double height, double aspect) const {
  const cv::Point2d bottom = project(foot);
  const double pixels = bottom.y - project(foot, height).y;
  return {bottom.x - aspect * pixels / 2, bottom.y - pixels, aspect * pixels, pixels};
}

double GroundCamera::half_width_at(double z) const {
  const double depth = kCosine * z + kSine * kHeight;
  return depth * image_.width / 2.0 / focal_;
}

}  // namespace sdmt::tools
