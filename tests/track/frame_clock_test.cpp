// SPDX-License-Identifier: Apache-2.0
#include "frame_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "sdmt/nn/random.h"

namespace sdmt::track {
namespace {

// What a caller does: asks, then says where the frame went.
int step(FrameClock& clock, std::optional<double> time, int& frame) {
  const int frames = clock.frames_until(time, frame);
  frame += frames;
  clock.set(time, frame);
  return frames;
}

TEST(FrameClock, AConstantRateCountsCalls) {
  for (const double rate : {25.0, 29.97, 7.0}) {
    FrameClock clock(rate, 100);
    int frame = 0;
    for (int i = 1; i <= 200'000; ++i) {
      ASSERT_EQ(step(clock, 1.7e9 + i / rate, frame), 1) << rate << " " << i;
    }
  }
  FrameClock without(0, 100);
  int frame = 0;
  for (const double time : {5.0, 1.0, 700.0}) EXPECT_EQ(step(without, time, frame), 1);
}

TEST(FrameClock, NothingAddsUpUnderJitterAndLostFrames) {
  FrameClock clock(25, 100);
  nn::Random random(1);
  int frame = 0;
  double time = 0;
  step(clock, 0, frame);
  for (int i = 1; i <= 20'000; ++i) {
    time += (random.uniform() < 0.2 ? 0.12 : 0.04) * (1 + 0.6 * (random.uniform() - 0.5));
    step(clock, time, frame);
    ASSERT_NEAR(frame - 1, time * 25, 3) << i;
  }
}

TEST(FrameClock, TwiceAsFastIsCountedAndMadeUpFor) {
  FrameClock clock(25, 100);
  int frame = 0;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(step(clock, i * 0.02, frame), 1);
  EXPECT_EQ(step(clock, 0.4, frame), 1);  // frame 11 of the clock, and the eleventh
  EXPECT_EQ(step(clock, 0.8, frame), 10);
}

TEST(FrameClock, JumpsCountAsTheLongestGapAndNothingRunsBackwards) {
  FrameClock clock(25, 100);
  int frame = 0;
  step(clock, 10, frame);
  EXPECT_EQ(step(clock, 1e9, frame), 100);
  EXPECT_EQ(step(clock, 1e9 + 0.08, frame), 2);
  for (const double wrong : {1e9, 5.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(clock.frames_until(wrong, frame), std::invalid_argument) << wrong;
  }
  EXPECT_EQ(step(clock, std::nullopt, frame), 1);
  EXPECT_EQ(step(clock, 1e9 + 0.16, frame), 1);
}

}  // namespace
}  // namespace sdmt::track
