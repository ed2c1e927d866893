// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/score_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace sdmt::track {
namespace {

TEST(ScoreCalibration, IsALogisticCurve) {
  const ScoreCalibration calibration{0.81, 0.11};
  EXPECT_DOUBLE_EQ(calibration.probability(0.81), 0.5);
  EXPECT_NEAR(calibration.probability(0.92), 0.7310585786300049, 1e-12);  // one scale above
  EXPECT_NEAR(calibration.probability(1.0), 0.849, 0.001);
  EXPECT_EQ(calibration.probability(-1e300), 0.0);
  EXPECT_EQ(calibration.probability(1e300), 1.0);
}

TEST(ScoreCalibration, ParsesPresetsAndNumbers) {
  EXPECT_FALSE(parse_calibration("none").has_value());
  EXPECT_EQ(parse_calibration("frcnn"), (ScoreCalibration{0.81, 0.11}));
  EXPECT_EQ(parse_calibration("acf"), (ScoreCalibration{20.5, 22.1}));
  EXPECT_EQ(parse_calibration("synthetic"), (ScoreCalibration{0.26, 0.52}));
  EXPECT_EQ(parse_calibration("-1.5,2"), (ScoreCalibration{-1.5, 2}));
  for (const char* wrong : {"", "dpm", "1", "1,", ",1", "1,0", "1,-2", "nan,1", "1,inf", "1,2,3"}) {
    EXPECT_THROW(parse_calibration(wrong), std::invalid_argument) << wrong;
  }
}

}  // namespace
}  // namespace sdmt::track
