// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/sequence_runner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace sdmt::pipeline {
namespace {

constexpr int kFrames = 10;

class TenFrames : public FrameSource {
 public:
  bool next(Frame& frame, bool decode) override {
    if (number_ == fails_at - 1) throw std::runtime_error("unplugged");
    if (number_ == kFrames) return false;
    frame.number = ++number_;
    if (decode) frame.image = image::Image(8, 8);
    return true;
  }
  int frame_count() const override { return kFrames; }
  double frame_rate() const override { return 0; }

  int fails_at = 0;

 private:
  int number_ = 0;
};

// One that looks at the frames, or not; it may throw in a frame.
class OneBox : public DetectionSource {
 public:
  explicit OneBox(bool looks, int fails_at = 0) : looks_(looks), fails_at_(fails_at) {}
  std::vector<mot::Detection> detect(const Frame& frame) override {
    last = frame.number;
    if (frame.number == fails_at_) throw std::runtime_error("out of order");
    return {{{10.0 + frame.number, 20, 30, 60}, 0.9}};
  }
  bool needs_images() const override { return looks_; }

  std::atomic<int> last = 0;

 private:
  bool looks_;
  int fails_at_;
};

struct Outcome {
  RunReport report;
  std::vector<track::FinishedFrame> frames;
};

Outcome run(FrameSource& frames, DetectionSource& detector, RunObservers observers = {}) {
  Outcome run;
  track::Tracker tracker;
  observers.finished = [&](const track::FinishedFrame& frame, const FrameTime&) {
    run.frames.push_back(frame);
    EXPECT_EQ(frame.frame, static_cast<int>(run.frames.size()));
  };
  observers.warning = [](const std::string& text) { ADD_FAILURE() << text; };
  run.report = run_sequence(frames, detector, tracker, false, observers);
  return run;
}

TEST(SequenceRunner, AFailingDetectorEndsTheRunAndLosesNothing) {
  for (const bool looks : {false, true}) {
    TenFrames frames;
    OneBox detector(looks, 8);
    const Outcome done = run(frames, detector);
    EXPECT_EQ(done.report.stats.frames, 7);
    ASSERT_EQ(done.frames.size(), 7u);
    for (const auto& frame : done.frames) EXPECT_EQ(frame.boxes.size(), 1u);
    EXPECT_EQ(detector.last, 8);
    EXPECT_FALSE(done.report.ended_early);
    EXPECT_THROW(std::rethrow_exception(done.report.failure), std::runtime_error);
  }
}

TEST(SequenceRunner, WhatLooksAheadGivesTheSame) {
  TenFrames one, two;
  OneBox ahead(true), beside(false);
  const Outcome a = run(one, ahead), b = run(two, beside);
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    ASSERT_EQ(a.frames[i].boxes.size(), b.frames[i].boxes.size());
    for (std::size_t k = 0; k < a.frames[i].boxes.size(); ++k) {
      EXPECT_EQ(a.frames[i].boxes[k].box, b.frames[i].boxes[k].box);
    }
  }
}

TEST(SequenceRunner, LooksAFewFramesAheadAtMost) {
  TenFrames frames;
  OneBox detector(true);
  RunObservers observers;
  int farthest = 0;
  observers.read = [&](const Frame& frame) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    farthest = std::max(farthest, detector.last - frame.number);
  };
  run(frames, detector, observers);
  EXPECT_GE(farthest, 1);
  EXPECT_LE(farthest, 3);  // two wait, one is looked at
}

TEST(SequenceRunner, EndsWhenToldTo) {
  TenFrames frames;
  OneBox detector(true);
  RunObservers observers;
  int read = 0;
  observers.read = [&](const Frame&) { ++read; };
  observers.stop = [&] { return read == 3; };
  EXPECT_EQ(run(frames, detector, observers).frames.size(), 3u);
}

TEST(SequenceRunner, ErrorsOfInputsAndObserversAreThrown) {
  TenFrames broken, whole;
  broken.fails_at = 5;
  OneBox detector(true), again(true);
  RunObservers observers;
  int read = 0;
  observers.read = [&](const Frame&) { ++read; };
  EXPECT_THROW(run(broken, detector, observers), std::runtime_error);
  EXPECT_EQ(read, 4);
  observers.read = [](const Frame&) { throw std::logic_error("full"); };
  EXPECT_THROW(run(whole, again, observers), std::logic_error);
}

}  // namespace
}  // namespace sdmt::pipeline
