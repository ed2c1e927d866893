// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/run_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/run_command.h"

namespace sdmt::pipeline {
namespace {

using testing::HasSubstr;
using tests::read_file;
using tests::write_file;

class RunStateTest : public testing::Test {
 protected:
  // Two people for 30 frames, as far as a run that ends without a word: its state remains.
  void SetUp() override {
    track::Tracker tracker(track::TrackerOptions::online());
    RunState state(folder_ / "state", "run", 10);
    state.resume(tracker, [](const auto&) {});
    for (int frame = 1; frame <= 30; ++frame) {
      const double x = 10.5 + 3.25 * frame;
      const std::vector<mot::Detection> boxes{{{x, 20, 40, 100}, 0.9},
                                              {{400 - x, 25, 40, 100}, 0.8}};
      for (const auto& done : tracker.update(boxes)) {
        finished_.push_back(done.frame);
        state.add(done);
      }
      state.frame_done(tracker);
    }
    ASSERT_GE(finished_.size(), 10u);
  }

  std::vector<int> resumed() const {
    track::Tracker tracker(track::TrackerOptions::online());
    std::vector<int> frames;
    RunState(folder_ / "state", "run", 10).resume(tracker, [&](const auto& frame) {
      frames.push_back(frame.frame);
    });
    return frames;
  }

  tests::TemporaryFolder folder_;
  std::vector<int> finished_;
};

TEST_F(RunStateTest, GoesOnFromWhatIsThere) { EXPECT_EQ(resumed(), finished_); }

TEST_F(RunStateTest, AChangedDigitIsRefused) {
  const std::string name = folder_ / "state.frames";
  const std::string whole = read_file(name);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (std::isdigit(static_cast<unsigned char>(whole[i])) == 0) continue;
    std::string changed = whole;
    changed[i] = changed[i] == '9' ? '1' : static_cast<char>(changed[i] + 1);
    write_file(name, changed);
    try {
      resumed();
      ADD_FAILURE() << "byte " << i << " of " << whole.size();
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(name + ": "));
    }
  }
  write_file(name, whole);
  EXPECT_EQ(resumed(), finished_);
}

TEST_F(RunStateTest, LinesThatAreGoneAreRefused) {
  const std::string name = folder_ / "state.frames";
  const std::string whole = read_file(name);
  write_file(name, whole.substr(whole.find('\n') + 1));
  EXPECT_THROW(resumed(), std::invalid_argument);
  write_file(name, whole.substr(0, whole.size() / 2));
  EXPECT_THROW(resumed(), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::pipeline
