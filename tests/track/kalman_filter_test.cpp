// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/kalman_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "sdmt/nn/random.h"

namespace sdmt::track {
namespace {

struct Row {
  int frames;
  mot::Cxcywh box;
  std::array<double, 8> filtered;
  double pp, pv, vv;
  std::array<double, 8> smoothed;
};

std::vector<Row> read_reference() {
  std::ifstream file(SDMT_TESTS_DIR "/track/fixtures/kalman.txt");
  std::vector<Row> rows;
  Row row;
  while (file >> row.frames >> row.box.cx >> row.box.cy >> row.box.width >> row.box.height) {
    for (double& value : row.filtered) file >> value;
    file >> row.pp >> row.pv >> row.vv;
    for (double& value : row.smoothed) file >> value;
    rows.push_back(row);
  }
  return rows;
}

// The noise of tests/parity/kalman_reference.py.
constexpr KalmanFilter::Noise kNoise{0.05, 0.01, 0.004, 0.1, 0.07};

void expect_state(const KalmanState& state, const std::array<double, 8>& expected,
                  const std::string& what) {
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(state.mean[i], expected[i], 1e-9) << what << " mean " << i;
    EXPECT_NEAR(state.velocity[i], expected[i + 4], 1e-9) << what << " velocity " << i;
  }
}

TEST(KalmanFilter, AgreesWithTheMatrixForm) {
  const auto rows = read_reference();
  ASSERT_EQ(rows.size(), 16u);
  const KalmanFilter filter(kNoise);
  std::vector<KalmanState> states = {filter.start(rows[0].box)};
  for (std::size_t i = 1; i < rows.size(); ++i) {
    states.push_back(filter.update(filter.predict(states.back(), rows[i].frames), rows[i].box));
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    expect_state(states[i], rows[i].filtered, "filtered " + std::to_string(i));
    EXPECT_NEAR(states[i].position_variance, rows[i].pp, 1e-9 * rows[i].pp);
    EXPECT_NEAR(states[i].covariance, rows[i].pv, 1e-9 * rows[i].pp);
    EXPECT_NEAR(states[i].velocity_variance, rows[i].vv, 1e-9 * rows[i].vv);
  }
  KalmanState smoothed = states.back();
  for (std::size_t i = rows.size() - 1; i > 0; --i) {
    smoothed = smooth(states[i - 1], rows[i].frames,
                      filter.smoother_gain(states[i - 1], rows[i].frames), smoothed);
    expect_state(smoothed, rows[i - 1].smoothed, "smoothed " + std::to_string(i - 1));
  }
}

TEST(KalmanFilter, AMeanderingMillionStepsStayFinite) {
  const KalmanFilter filter({});
  nn::Random random(11);
  KalmanState state = filter.start({0, 0, 10, 20});
  for (int i = 0; i < 1'000'000; ++i) {
    state = filter.predict(state, 1 + static_cast<int>(random.below(3)));
    ASSERT_GE(state.mean[2], KalmanFilter::kMinimumSize);
    ASSERT_GE(state.mean[3], KalmanFilter::kMinimumSize);
    // Sizes over eighteen orders of magnitude, positions anywhere.
    const double size = std::pow(10.0, random.uniform(-9, 9));
    if (random.uniform() < 0.6) {
      state = filter.update(state, {random.uniform(-1e9, 1e9), random.uniform(-1e9, 1e9), size,
                                    size * random.uniform(0.1, 10)});
    }
    for (std::size_t k = 0; k < 4; ++k) {
      ASSERT_TRUE(std::isfinite(state.mean[k]) && std::isfinite(state.velocity[k])) << i;
    }
    const double determinant =
        state.position_variance * state.velocity_variance - state.covariance * state.covariance;
    ASSERT_GT(state.position_variance, 0) << i;
    ASSERT_GT(state.velocity_variance, 0) << i;
    ASSERT_GE(determinant, -1e-9 * state.position_variance * state.velocity_variance) << i;
  }
}

TEST(KalmanFilter, ExtrapolationKeepsTheSize) {
  KalmanState state;
  state.mean = {100, 200, 40, 90};
  state.velocity = {2, -1, -5, 10};
  EXPECT_EQ(extrapolate(state, 90), (mot::Cxcywh{280, 110, 40, 90}));
  EXPECT_EQ(extrapolate(state, -10), (mot::Cxcywh{80, 210, 40, 90}));
}

}  // namespace
}  // namespace sdmt::track
