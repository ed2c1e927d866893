// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <set>
#include <thread>

#include "cli/run_command.h"
#include "sdmt/mot/box.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;

CommandResult make_scene(const std::filesystem::path& folder, const std::string& seed,
                         const std::string& threads = "2") {
  return run_sdmt({"synth", "scene", "--output", folder, "--frames", "40", "--walkers", "6",
                   "--width", "320", "--height", "180", "--seed", seed, "--threads", threads});
}

TEST(SynthScene, IsASequenceThatOurReadersRead) {
  const TemporaryFolder folder;
  const auto result = make_scene(folder / "scene", "3");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto sequence = mot::Sequence::read(folder / "scene");
  EXPECT_EQ(sequence.length, 40);
  EXPECT_EQ(sequence.width, 320);
  EXPECT_TRUE(std::filesystem::exists(sequence.image(40)));

  const auto truth = mot::read_ground_truth(sequence.ground_truth());
  const auto detections = mot::DetectionFile::read(sequence.detections());
  std::set<int> ids;
  int found = 0;
  int hidden = 0;
  for (const auto& row : truth) {
    ids.insert(row.id);
    EXPECT_EQ(row.category, 1);
    hidden += row.visibility < 0.5 ? 1 : 0;
    for (const auto& detection : detections.frame(row.frame)) {
      if (mot::iou(detection.box, row.box) >= 0.5) {
        ++found;
        break;
      }
    }
  }
  // The detector is good but neither perfect nor free of false alarms.
  EXPECT_GE(ids.size(), 6u);
  EXPECT_GT(found, static_cast<int>(truth.size() * 6 / 10));
  EXPECT_LT(found, static_cast<int>(truth.size()));
  int false_alarms = 0;
  for (int frame = 1; frame <= sequence.length; ++frame) {
    for (const auto& detection : detections.frame(frame)) {
      false_alarms += std::none_of(truth.begin(), truth.end(), [&](const auto& row) {
        return row.frame == frame && mot::iou(detection.box, row.box) > 0;
      });
    }
  }
  EXPECT_GT(false_alarms, 0);
  EXPECT_GT(hidden, 0);
}

TEST(SynthScene, TheSeedDecidesEveryByte) {
  const TemporaryFolder folder;
  ASSERT_EQ(make_scene(folder / "a", "5", "1").exit_code, 0);
  ASSERT_EQ(make_scene(folder / "b", "5", "2").exit_code, 0);
  ASSERT_EQ(make_scene(folder / "c", "6").exit_code, 0);
  for (const std::string file : {"gt/gt.txt", "det/det.txt", "img1/000040.jpg"}) {
    EXPECT_EQ(read_file(folder / ("a/" + file)), read_file(folder / ("b/" + file))) << file;
    EXPECT_NE(read_file(folder / ("a/" + file)), read_file(folder / ("c/" + file))) << file;
  }
}

TEST(SynthScene, RefusesImpossibleOptions) {
  const TemporaryFolder folder;
  const auto result = run_sdmt({"synth", "scene", "--output", folder / "s", "--walkers", "0"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("walkers is 0, expected 1 to 200"));
  write_file(folder / "file", "");
  const auto blocked = run_sdmt({"synth", "scene", "--output", folder / "file/scene"});
  EXPECT_EQ(blocked.exit_code, 2);
  EXPECT_THAT(blocked.err, HasSubstr("file/scene"));
}

TEST(SynthScene, LeavesOtherFilesAlone) {
  const TemporaryFolder folder;
  write_file(folder / "precious.txt", "");
  const auto result = run_sdmt({"synth", "scene", "--output", folder.path()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is not empty, expected a new or empty folder"));
  EXPECT_EQ(folder.listing(), std::vector<std::string>{"precious.txt"});
}

TEST(SynthScene, InterruptedLeavesNothing) {
  const TemporaryFolder folder;
  for (const std::string kind : {"scene", "reid"}) {
    Process process(sdmt_words({"synth", kind, "--output", folder / kind}));
    while (!std::filesystem::exists(folder / kind))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    process.send_signal(SIGINT);
    const auto result = process.wait();
    EXPECT_EQ(result.exit_code, 128 + SIGINT);
    EXPECT_THAT(result.out, HasSubstr("stopped, nothing written"));
    EXPECT_TRUE(std::filesystem::is_empty(folder / kind));
  }
}

}  // namespace
}  // namespace sdmt::tests
