// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::pipeline {

struct HogOptions {
  /// The smallest person looked for, pixels of height, 24..1000. The frame is resized so that such
  /// a person fills the detector's window; halving this quadruples the time. 0: kSmallest, and in
  /// large pictures more, so that the time stays that of 1.07 megapixels (in 1920 x 1080 89).
  int min_person_height = 0;

  static constexpr int kSmallest = 64;

  /// Throws std::invalid_argument for a value out of range.
  void validate() const;
};

}  // namespace sdmt::pipeline
