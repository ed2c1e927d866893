// SPDX-License-Identifier: Apache-2.0
#include "frame_clock.h"

#include <algorithm>
#include <cmath>

#include "sdmt/io/checked_value.h"

namespace sdmt::track {

double FrameClock::exact_frames_until(double time, int frame) const {
  return std::round((time - origin_time_) * frame_rate_) - (frame - origin_frame_);
}

int FrameClock::frames_until(std::optional<double> time, int frame) const {
  if (!time || frame_rate_ == 0) return 1;
  if (!std::isfinite(*time)) io::require(false, "time", *time, "a finite number of seconds");
  if (!last_time_) return 1;
  if (!(*time > *last_time_)) {
    io::require(false, "time", *time,
                "> " + io::number_text(*last_time_) + ", that of the frame before");
  }
  return static_cast<int>(
      std::clamp(exact_frames_until(*time, frame), 1.0, static_cast<double>(longest_gap_)));
}

void FrameClock::set(std::optional<double> time, int frame) {
  if (frame_rate_ == 0) return;
  if (!time) {  // a frame after the last one
    if (last_time_) *last_time_ += 1 / frame_rate_;
    return;
  }
  if (!last_time_ || exact_frames_until(*time, frame) > 0) {
    origin_time_ = *time;
    origin_frame_ = frame;
  }
  last_time_ = time;
}

}  // namespace sdmt::track
