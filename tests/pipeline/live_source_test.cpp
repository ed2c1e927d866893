// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/live_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "sdmt/pipeline/utc_time.h"

namespace sdmt::pipeline {
namespace {

using std::chrono::milliseconds;

// A camera that gives `frames` frames, 1, 2, ... in the only pixel, `pause` apart, and is then
// lost.
class Camera : public FrameSource {
 public:
  Camera(int frames, milliseconds pause, std::atomic<int>& shown)
      : frames_(frames), pause_(pause), shown_(shown) {}
  bool next(Frame& frame, bool) override {
    if (frames_-- == 0) return false;
    std::this_thread::sleep_for(pause_);
    frame.image = image::Image(1, 1);
    frame.image.bgr[0] = static_cast<std::uint8_t>(++shown_);
    return true;
  }
  int frame_count() const override { return 0; }
  double frame_rate() const override { return 0; }
  bool endless() const override { return true; }
  std::int64_t garbled() const override { return 2; }

 private:
  int frames_;
  milliseconds pause_;
  std::atomic<int>& shown_;
};

class LiveSources : public testing::Test {
 protected:
  LiveSources() {
    options_.first_pause = 0.001;
    options_.tell = [this](const std::string& text) { told_.push_back(text); };
  }
  // Opened again it gives `again` frames, as often as it is lost.
  std::unique_ptr<LiveSource> source(int frames, milliseconds pause, int again = 0) {
    const auto open = [this, pause, again]() -> std::unique_ptr<FrameSource> {
      if (++attempts_ % 3 != 0) throw std::runtime_error("away");
      return std::make_unique<Camera>(again, pause, shown_);
    };
    return std::make_unique<LiveSource>("camera", std::make_unique<Camera>(frames, pause, shown_),
                                        open, std::make_shared<std::atomic<bool>>(false), options_);
  }

  LiveOptions options_;
  std::atomic<int> shown_ = 0;
  std::atomic<int> attempts_ = 0;
  std::vector<std::string> told_;
};

TEST_F(LiveSources, WhoIsSlowGetsTheNewestFrame) {
  options_.reconnect = false;
  const auto live = source(40, milliseconds(5));
  Frame frame;
  int taken = 0, last = 0;
  double time = -1;
  while (live->next(frame, true)) {
    EXPECT_EQ(frame.number, ++taken);
    EXPECT_GT(frame.image.bgr[0], last);
    EXPECT_LE(shown_ - frame.image.bgr[0], 1);
    EXPECT_GT(*frame.when.time, time);
    last = frame.image.bgr[0];
    time = *frame.when.time;
    std::this_thread::sleep_for(milliseconds(25));
  }
  const auto counts = *live->live();
  EXPECT_EQ(last, 40);
  EXPECT_LT(taken, 20);
  EXPECT_EQ(counts.received, 40);
  EXPECT_EQ(counts.dropped, 40 - taken);
  EXPECT_GE(counts.longest_lag, 0.025);
  EXPECT_EQ(counts.garbled, 2);
}

TEST_F(LiveSources, NoneIsLostWhereTheirNumbersMatter) {
  options_.reconnect = false;
  options_.newest_only = false;
  const auto live = source(40, milliseconds(0));
  Frame frame;
  int taken = 0;
  while (live->next(frame, true)) {
    EXPECT_EQ(frame.image.bgr[0], ++taken);
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_EQ(taken, 40);
  EXPECT_EQ(live->live()->dropped, 0);
}

TEST_F(LiveSources, LostFiftyTimesItGoesOn) {
  options_.newest_only = false;
  const auto live = source(3, milliseconds(0), 3);
  Frame frame;
  for (int i = 1; i <= 3 * 51; ++i) {
    ASSERT_TRUE(live->next(frame, true));
    EXPECT_EQ(frame.number, i);
    EXPECT_EQ(frame.image.bgr[0], i);
  }
  EXPECT_GE(live->live()->losses, 50);
  ASSERT_GE(told_.size(), 100u);
  EXPECT_THAT(told_[0],
              testing::MatchesRegex("camera: lost after 3 frames, 20..-..-..T..:..:......Z: it "
                                    "gives no more frames; it is opened again until it answers"));
  EXPECT_THAT(told_[1], testing::MatchesRegex("camera: is back, 20.*Z, after 0.. s"));
  EXPECT_GE(attempts_, 150);
}

TEST_F(LiveSources, ASignalEndsWaiting) {
  const auto start = std::chrono::steady_clock::now();
  options_.stop = [start] { return std::chrono::steady_clock::now() - start > milliseconds(100); };
  options_.first_pause = 30;
  const auto live = source(0, milliseconds(0));
  Frame frame;
  EXPECT_FALSE(live->next(frame, true));
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(2000));
}

TEST_F(LiveSources, RefuseTimesThatAreNone) {
  options_.timeout = 0;
  EXPECT_THROW(source(1, milliseconds(0)), std::invalid_argument);
}

TEST(UtcTime, IsThatOfTheCalendar) {  // date -u -d @1772373909
  EXPECT_EQ(utc_text(std::chrono::system_clock::time_point(milliseconds(1772373909250))),
            "2026-03-01T14:05:09.250Z");
  EXPECT_EQ(utc_text({}), "1970-01-01T00:00:00.000Z");
}

}  // namespace
}  // namespace sdmt::pipeline
