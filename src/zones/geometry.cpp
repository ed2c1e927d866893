// SPDX-License-Identifier: Apache-2.0
#include "geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdmt::zones {

namespace {

// Twice the area of the triangle a, b, p; positive when p is to the right hand of a walk from a to
// b in a picture, whose y points down.
double turn(Point a, Point b, Point p) {
  return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
}

double segment_distance(Point a, Point b, Point p) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double length = dx * dx + dy * dy;
  const double along = length > 0 ? ((p.x - a.x) * dx + (p.y - a.y) * dy) / length : 0;
  const double t = std::clamp(along, 0.0, 1.0);
  return std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
}

// Calls visit(a, b) for every edge.
template <typename Visit>
void for_each_edge(const Area& area, Visit&& visit) {
  Point last = area.corners.back();
  for (const Point corner : area.corners) {
    visit(last, corner);
    last = corner;
  }
}

}  // namespace

double signed_distance(const Line& line, Point p) {
  return turn(line.from, line.to, p) / std::hypot(line.to.x - line.from.x, line.to.y - line.from.y);
}

int crossing(const Line& line, Point a, Point b) {
  const bool was_in = turn(line.from, line.to, a) >= 0;
  const bool is_in = turn(line.from, line.to, b) >= 0;
  if (was_in == is_in) return 0;
  // The line's ends lie on different sides of the step.
  const bool from_right = turn(a, b, line.from) >= 0;
  const bool to_right = turn(a, b, line.to) >= 0;
  if (from_right == to_right) return 0;
  return is_in ? 1 : -1;
}

bool contains(const Area& area, Point p) {
  bool inside = false;
  for_each_edge(area, [&](Point a, Point b) {
    if ((a.y > p.y) == (b.y > p.y)) return;
    if (p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x)) inside = !inside;
  });
  return inside;
}

double edge_distance(const Area& area, Point p) {
  double nearest = std::numeric_limits<double>::infinity();
  for_each_edge(area,
                [&](Point a, Point b) { nearest = std::min(nearest, segment_distance(a, b, p)); });
  return nearest;
}

double depth(const Area& area) {
  constexpr int kCells = 32;
  const auto [left, right] = std::minmax_element(area.corners.begin(), area.corners.end(),
                                                 [](Point a, Point b) { return a.x < b.x; });
  const auto [top, bottom] = std::minmax_element(area.corners.begin(), area.corners.end(),
                                                 [](Point a, Point b) { return a.y < b.y; });
  double deepest = 0;
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column) {
      const Point p{left->x + (column + 0.5) / kCells * (right->x - left->x),
                    top->y + (row + 0.5) / kCells * (bottom->y - top->y)};
      if (contains(area, p)) deepest = std::max(deepest, edge_distance(area, p));
    }
  }
  return deepest;
}

bool segments_meet(Point a, Point b, Point c, Point d) {
  const auto sign = [](double value) { return (value > 0) - (value < 0); };
  const int c_side = sign(turn(a, b, c)), d_side = sign(turn(a, b, d));
  const int a_side = sign(turn(c, d, a)), b_side = sign(turn(c, d, b));
  if (c_side != d_side && a_side != b_side) return true;
  // A point of one on the other, or both on one line.
  const auto between = [](Point p, Point q, Point r) {
    return std::min(p.x, q.x) <= r.x && r.x <= std::max(p.x, q.x) && std::min(p.y, q.y) <= r.y &&
           r.y <= std::max(p.y, q.y);
  };
  return (c_side == 0 && between(a, b, c)) || (d_side == 0 && between(a, b, d)) ||
         (a_side == 0 && between(c, d, a)) || (b_side == 0 && between(c, d, b));
}

}  // namespace sdmt::zones
