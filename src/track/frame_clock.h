// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace sdmt::track {

/// Turns times into frames of the rate that the options are meant for. A time is rounded to the
/// nearest frame counted from the first one, so that nothing adds up over hours; two times closer
/// than a frame are a frame apart, and what was counted too much is left out again later.
class FrameClock {
 public:
  /// `frame_rate`: frames a second; 0: times are not looked at. `longest_gap`: frames after which
  /// nothing of before matters; longer gaps count as this one, and counting begins anew.
  FrameClock(double frame_rate, int longest_gap)
      : frame_rate_(frame_rate), longest_gap_(longest_gap) {}

  /// Frames from `frame`, the last one, to the one at `time`: 1..longest_gap, 1 without a time.
  /// Throws std::invalid_argument for a time that is not finite or not after the last one.
  int frames_until(std::optional<double> time, int frame) const;
  /// The frame with this number is at `time`.
  void set(std::optional<double> time, int frame);

 private:
  friend struct Snapshot;

  double exact_frames_until(double time, int frame) const;

  double frame_rate_;
  int longest_gap_;
  std::optional<double> last_time_;
  double origin_time_ = 0;
  int origin_frame_ = 0;
};

}  // namespace sdmt::track
