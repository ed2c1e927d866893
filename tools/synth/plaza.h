// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "synth/ground_camera.h"

namespace sdmt::tools {

/// Something that stands in the plaza and hides people behind it.
struct Occluder {
  enum class Kind { lamp_post, tree, advertising_column };
  Kind kind = Kind::lamp_post;
  GroundPoint foot;
};

/// The place the walkers cross: paving, house fronts, sky, and what stands about. All of it follows
/// from the seed.
class Plaza {
 public:
  Plaza(const GroundCamera& camera, std::uint64_t seed);

  /// The empty place, BGR.
  const cv::Mat& background() const { return background_; }
  const std::vector<Occluder>& occluders() const { return occluders_; }
  /// Draws one of them.
  void draw(const Occluder& occluder, cv::Mat& image) const;
  /// The part of the image where an occluder hides what is behind it.
  cv::Rect2d hidden_box(const Occluder& occluder) const;
  /// Light at a point: 1 in the sun, less in the shade of the houses.
  double light_at(const GroundPoint& point) const;

 private:
  void paint_sky_and_houses(std::uint64_t seed);
  void paint_ground(std::uint64_t seed);

  GroundCamera camera_;
  cv::Mat background_;
  std::vector<Occluder> occluders_;
};

}  // namespace sdmt::tools
