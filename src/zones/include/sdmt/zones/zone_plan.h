// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace sdmt::zones {

/// A place in the picture, in pixels; the first pixel is 1, as in boxes. y points down.
struct Point {
  double x = 0;
  double y = 0;

  bool operator==(const Point&) const = default;
};

/// A line on the ground that people cross. "In" is to the right hand of somebody who walks from
/// `from` to `to`: downwards for a line drawn from left to right.
struct Line {
  std::string name;
  Point from, to;
};

/// A part of the ground in which people are. Its corners in either order, each once; edges do not
/// cross.
struct Area {
  std::string name;
  std::vector<Point> corners;
};

/// What is to be counted in a picture.
struct ZonePlan {
  int width = 0;  ///< of the picture in which the points are given; 0: of whatever is counted in
  int height = 0;
  std::vector<Line> lines;
  std::vector<Area> areas;

  /// Throws std::invalid_argument, naming the zone, unless there is a zone, names are unique and of
  /// 1 to 64 bytes, points lie within a million pixels, lines have a length, and areas have 3 to
  /// 200 corners, an extent, and no edges that cross.
  void validate() const;

  /// The plan for a picture of another size. Throws std::invalid_argument when a zone lies wholly
  /// outside of that picture, or the plan names a picture of other proportions (by more than 2 %).
  ZonePlan in_picture(int picture_width, int picture_height) const;
};

/// Reads a plan:
///   {"picture": [1920, 1080],
///    "lines": [{"name": "door", "from": [800, 900], "to": [1100, 900]}],
///    "areas": [{"name": "queue", "corners": [[100, 700], [500, 700], [500, 1000], [100, 1000]]}]}
/// "picture" may be left out, and so may one of the lists. Throws std::invalid_argument, beginning
/// with `name`, for anything else, unknown keys too.
ZonePlan parse_zone_plan(std::string_view text, const std::string& name);

/// Throws as parse_zone_plan and io::read_text.
ZonePlan read_zone_plan(const std::filesystem::path& file);

}  // namespace sdmt::zones
