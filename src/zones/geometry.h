// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/zones/zone_plan.h"

namespace sdmt::zones {

/// Pixels from the infinite line through `line`; positive on its "in" side.
double signed_distance(const Line& line, Point p);

/// How a step from `a` to `b` crosses the line between its ends: 1 inwards, -1 outwards, 0 not at
/// all. A point on the line is on its "in" side, so that a walk of many steps crosses as often as
/// the walker does.
int crossing(const Line& line, Point a, Point b);

/// Whether the area holds the point (even-odd rule).
bool contains(const Area& area, Point p);

/// Pixels from the area's edge, on either side of it.
double edge_distance(const Area& area, Point p);

/// How far from its edge one can be within the area, from below (on a grid of 32 x 32).
double depth(const Area& area);

/// Whether two segments have a point in common.
bool segments_meet(Point a, Point b, Point c, Point d);

}  // namespace sdmt::zones
