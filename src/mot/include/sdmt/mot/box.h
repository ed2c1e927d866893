// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::mot {

/// Top-left corner and size in pixels, in the coordinates of whoever made the box: MOTChallenge
/// files and everything the tracker takes and returns count the first pixel as 1.
struct Tlwh {
  double left = 0;
  double top = 0;
  double width = 0;
  double height = 0;

  bool operator==(const Tlwh&) const = default;
};

/// Centre and size in pixels: what the Kalman filter estimates.
struct Cxcywh {
  double cx = 0;
  double cy = 0;
  double width = 0;
  double height = 0;

  bool operator==(const Cxcywh&) const = default;
};

Cxcywh to_cxcywh(const Tlwh& box);
Tlwh to_tlwh(const Cxcywh& box);

/// Width times height; 0 for a box without extent.
double area(const Tlwh& box);

/// Intersection over union in [0, 1] (equation 1 of the paper); 0 when the union is empty.
double iou(const Tlwh& a, const Tlwh& b);

}  // namespace sdmt::mot
