// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <filesystem>
#include <stdexcept>

#include "tuning/scenes.h"

namespace sdmt::tuning {
namespace {

void expect_same(const eval::RunGrid& a, const eval::RunGrid& b) {
  ASSERT_EQ(a.settings(), b.settings());
  for (int setting = 0; setting < a.settings(); ++setting) {
    for (int sequence = 0; sequence < a.sequences(); ++sequence) {
      for (int draw = 0; draw < a.draws(); ++draw) {
        EXPECT_EQ(a.at(setting, sequence, draw), b.at(setting, sequence, draw));
      }
    }
  }
}

class Run : public testing::Test {
 protected:
  void SetUp() override { omp_set_num_threads(3); }

  std::optional<eval::RunGrid> run(const std::string& state,
                                   const std::function<void(std::int64_t)>& progress,
                                   bool stop = false) {
    return run_tuning(plan_, state, progress, [stop] { return stop; });
  }
  Scenes scenes_;
  TuningPlan plan_ = make_plan(scenes_.options(), {});
};

TEST_F(Run, ErrorsOfCallbacksEndTheWorkWhichGoesOnFromItsState) {
  const auto whole = run("", [](std::int64_t) {});
  ASSERT_TRUE(whole);
  std::int64_t reached = 0, calls = 0;
  const auto fails_at_five = [&](std::int64_t done) {
    ++calls;
    if (done == 5) throw std::runtime_error("enough");
  };
  EXPECT_THROW(run(scenes_.file("state"), fails_at_five), std::runtime_error);
  EXPECT_LE(calls, 5 + 2);  // what two other threads were at
  const auto rest = run(scenes_.file("state"), [&](std::int64_t done) {
    if (reached == 0) reached = done;
  });
  ASSERT_TRUE(rest);
  EXPECT_GE(reached, 6);
  EXPECT_LE(reached, 5 + 2 + 1);
  expect_same(*rest, *whole);
}

TEST_F(Run, StopsWhenItIsToldTo) {
  std::int64_t last = 0;
  EXPECT_FALSE(run(
      scenes_.file("state"), [&](std::int64_t done) { last = done; }, true));
  EXPECT_LE(last, 3);
  expect_same(*run(scenes_.file("state"), [](std::int64_t) {}), *run("", [](std::int64_t) {}));
}

TEST_F(Run, AStateBelongsToItsSearch) {
  run(scenes_.file("state"), [](std::int64_t) {});
  plan_.drop = 0.3;
  EXPECT_THROW(run(scenes_.file("state"), [](std::int64_t) {}), std::invalid_argument);
  EXPECT_THROW(run(scenes_.file("no/state"), [](std::int64_t) {}), std::runtime_error);
}

// A draw leaves boxes out, so that less is found; the first leaves none out.
TEST_F(Run, DrawsLeaveBoxesOut) {
  const auto found = [&](double drop) {
    plan_.drop = drop;
    return *run("", [](std::int64_t) {});
  };
  const eval::RunGrid few = found(0.6), all = found(0);
  const int bytetrack = all.settings() - 1;
  for (const int setting : {0, bytetrack}) {
    for (const int sequence : {0, 1}) {
      EXPECT_EQ(few.at(setting, sequence, 0), all.at(setting, sequence, 0));
      EXPECT_EQ(all.at(setting, sequence, 1), all.at(setting, sequence, 0));
      EXPECT_LT(few.at(setting, sequence, 1).tp, all.at(setting, sequence, 1).tp);
    }
  }
}

}  // namespace
}  // namespace sdmt::tuning
