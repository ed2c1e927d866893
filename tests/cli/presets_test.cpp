// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cli/track_scene.h"
#include "sdmt/track/score_calibration.h"

namespace sdmt::tests {
namespace {

TEST(DetectorPresets, EveryDetectorFileNamesAKnownCalibration) {
  for (const std::string name : {"frcnn", "acf", "synthetic"}) {
    const auto file = read_file(SDMT_CONFIGS_DIR + ("/detector-" + name + ".json"));
    EXPECT_EQ(nlohmann::json::parse(file), (nlohmann::json{{"calibration", name}}));
    EXPECT_TRUE(track::parse_calibration(name).has_value());
  }
}

using TrackerPresets = TrackScene;

TEST_F(TrackerPresets, TunedIsTheDefaultAndPaperIsNot) {
  const auto scene = picture_sequence("s", 60);
  ASSERT_EQ(track(scene, {"--appearance", "histogram"}).exit_code, 0);
  const std::string expected = tracks();
  auto result = track(scene, {"--appearance", "histogram", "--config", "track-tuned"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(tracks(), expected);
  result = track(scene, {"--appearance", "histogram", "--config", "track-paper"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(tracks(), expected);
}

}  // namespace
}  // namespace sdmt::tests
