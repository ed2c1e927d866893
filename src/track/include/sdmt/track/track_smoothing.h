// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sdmt/track/finished_frame.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// Smooths the boxes of finished tracks and fills their gaps, whichever tracker they come from, as
/// Tracker does with its own: for peers that are to be compared alike. Offline: each box is the
/// Rauch-Tung-Striebel estimate from the whole track. Give boxes as the detector measured them
/// (ByteTrackOptions::report); smoothing those that a filter has smoothed already blunts turns.
///
/// `frames` are consecutive; `output.delay` is not used. Throws std::invalid_argument as
/// TrackerOptions::validate(), for frames that are not consecutive, and where `output.amodal` is
/// still OutputOptions::kInputSize.
std::vector<FinishedFrame> smooth_tracks(std::span<const FinishedFrame> frames,
                                         const OutputOptions& output, const MotionOptions& motion);

}  // namespace sdmt::track
