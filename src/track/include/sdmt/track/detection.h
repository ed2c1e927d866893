// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/track/box.h"

namespace sdmt::track {

/// One box proposed by a detector in one frame.
struct Detection {
  Tlwh box;
  /// The detector's score; any finite value. A ScoreCalibration turns raw margins
  /// into probabilities before the tracker sees them.
  double score = 1.0;
};

}  // namespace sdmt::track
