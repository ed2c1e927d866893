// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/sequence_runner.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace sdmt::pipeline {
namespace {

class TenFrames : public FrameSource {
 public:
  bool next(Frame& frame, bool) override { return ++frame.number <= 10; }
  int frame_count() const override { return 10; }
  double frame_rate() const override { return 0; }
};

class FailsInFrame8 : public DetectionSource {
 public:
  std::vector<mot::Detection> detect(const Frame& frame) override {
    if (frame.number == 8) throw std::runtime_error("out of order");
    return {{{10.0 + frame.number, 20, 30, 60}, 0.9}};
  }
};

TEST(SequenceRunner, AFailingDetectorEndsTheRunAndLosesNothing) {
  TenFrames frames;
  FailsInFrame8 detector;
  track::Tracker tracker;
  int finished = 0, boxes = 0;
  RunObservers observers;
  observers.finished = [&](const track::FinishedFrame& frame, const FrameTime&) {
    EXPECT_EQ(frame.frame, ++finished);
    boxes += static_cast<int>(frame.boxes.size());
  };
  observers.warning = [](const std::string& text) { ADD_FAILURE() << text; };
  const RunReport report = run_sequence(frames, detector, tracker, false, observers);
  EXPECT_EQ(report.stats.frames, 7);
  EXPECT_EQ(finished, 7);
  EXPECT_EQ(boxes, 7);
  EXPECT_FALSE(report.ended_early);
  EXPECT_THROW(std::rethrow_exception(report.failure), std::runtime_error);
}

}  // namespace
}  // namespace sdmt::pipeline
