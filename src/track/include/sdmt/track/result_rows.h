// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/mot/mot_file.h"
#include "sdmt/track/finished_frame.h"

namespace sdmt::track {

/// Appends the frame as MOTChallenge result rows (confidence: the score of detections, 0 for other
/// sources).
void append_results(const FinishedFrame& frame, std::vector<mot::ResultRow>& rows);

}  // namespace sdmt::track
