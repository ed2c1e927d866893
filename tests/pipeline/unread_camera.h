// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// Stands for a camera of no known frame rate, whose frames come once; none are read from it.
class UnreadCamera : public FrameSource {
 public:
  bool next(Frame&, bool) override { return false; }
  int frame_count() const override { return 0; }
  double frame_rate() const override { return 0; }
  bool repeatable() const override { return false; }
};

}  // namespace sdmt::pipeline
