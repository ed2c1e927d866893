// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/mot/box.h"

namespace sdmt::mot {

/// Largest coordinate and size of a detection, pixels: squares and products stay far from overflow.
inline constexpr double kFarthest = 1e12;

/// One box proposed by a detector in one frame.
struct Detection {
  Tlwh box;
  /// The detector's score; any finite value. A ScoreCalibration turns raw margins
  /// into probabilities before the tracker sees them.
  double score = 1.0;
};

}  // namespace sdmt::mot
