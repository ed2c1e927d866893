// SPDX-License-Identifier: Apache-2.0
// sdmt tune from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class Tune : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::string seed : {"1", "2", "3"}) {
      const auto result =
          run_sdmt({"synth", "scene", "--output", folder_ / ("s" + seed), "--frames", "60",
                    "--walkers", "5", "--width", "320", "--height", "180", "--seed", seed});
      ASSERT_EQ(result.exit_code, 0) << result.err;
    }
  }
  CommandResult tune(const std::string& name, std::vector<std::string> more = {},
                     const std::string& draws = "2") {
    std::vector<std::string> words{"tune",
                                   "--sequences",
                                   folder_ / "s1",
                                   folder_ / "s2",
                                   folder_ / "s3",
                                   "--option",
                                   "min-length=2,4,6",
                                   "max-fill=5,60",
                                   "--draws",
                                   draws,
                                   "--json",
                                   folder_ / (name + ".json"),
                                   "--output",
                                   folder_ / (name + ".config")};
    words.insert(words.end(), more.begin(), more.end());
    return run_sdmt(words);
  }
  std::string outputs(const std::string& name) {
    return read_file(folder_ / (name + ".json")) + read_file(folder_ / (name + ".config"));
  }
  TemporaryFolder folder_;
};

TEST_F(Tune, TheSameBytesWithAnyThreadsAndInterruptions) {
  const auto first = tune("a", {"--threads", "1", "--state", folder_ / "state"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("held out"));
  ASSERT_EQ(tune("b", {"--threads", "3"}).exit_code, 0);
  EXPECT_EQ(outputs("a"), outputs("b"));
  const std::string whole = read_file(folder_ / "state");
  for (const double part : {0.3, 0.6, 0.9}) {  // killed anywhere, in the middle of a line too
    const auto begun = whole.find('\n') + 1;
    const auto kept =
        begun + static_cast<std::size_t>(part * static_cast<double>(whole.size() - begun));
    write_file(folder_ / "cut", whole.substr(0, kept));
    ASSERT_EQ(tune("c", {"--threads", "2", "--state", folder_ / "cut"}).exit_code, 0);
    EXPECT_EQ(outputs("c"), outputs("a")) << part;
  }
  const auto other = tune("d", {"--seed", "2", "--state", folder_ / "state"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("is the state of another search"));
}

// The figures are those that track and evaluate give one by one.
TEST_F(Tune, CountsWhatTrackAndEvaluateCount) {
  ASSERT_EQ(tune("a", {}, "1").exit_code, 0);
  const auto found = json::parse(read_file(folder_ / "a.json"));
  for (const std::string scene : {"s1", "s2", "s3"}) {
    ASSERT_EQ(run_sdmt({"track", folder_ / scene, "--no-appearance", "--output",
                        folder_ / (scene + ".txt")})
                  .exit_code,
              0);
    ASSERT_EQ(
        run_sdmt({"evaluate", "--gt", folder_ / scene, "--results", folder_ / (scene + ".txt"),
                  "--benchmark", "MOT16", "--json", folder_ / "e.json"})
            .exit_code,
        0);
    const auto scores = json::parse(read_file(folder_ / "e.json")).at("combined");
    for (const auto& row : found.at("by_sequence")) {
      if (row.at("sequence") != scene) continue;
      EXPECT_DOUBLE_EQ(row.at("base").at("mota"), scores.at("MOTA"));
      EXPECT_DOUBLE_EQ(row.at("base").at("idf1"), scores.at("IDF1"));
    }
  }
}

TEST_F(Tune, EmbedsOnceAndWritesAPresetThatTrackTakes) {
  const auto result =
      tune("a", {"--appearance", "histogram", "--option", "lambda=0,1", "--settings", "5"}, "1");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(read_file(folder_ / "a.json")).at("settings"), 5);
  EXPECT_EQ(run_sdmt({"track", folder_ / "s1", "--appearance", "histogram", "--config",
                      folder_ / "a.config", "--output", folder_ / "t.txt"})
                .exit_code,
            0);
}

// Whole numbers, numbers without an end and words.
TEST_F(Tune, EveryPresetGoesThroughItsFile) {
  ASSERT_EQ(tune("a", {"--config", "track-paper"}, "1").exit_code, 0);
  const auto preset = json::parse(read_file(folder_ / "a.config"));
  EXPECT_EQ(preset.at("max-misses").dump(), "2");
  EXPECT_EQ(preset.at("strong-confidence"), "-inf");
  EXPECT_EQ(preset.at("motion-association"), false);
  const auto result = run_sdmt({"track", folder_ / "s1", "--no-appearance", "--config",
                                folder_ / "a.config", "--output", folder_ / "t.txt"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Tune, SaysWhatCannotBe) {
  EXPECT_THAT(tune("a", {"--option", "speed=1"}).err, HasSubstr("no option 'speed'"));
  EXPECT_THAT(tune("a", {"--option", "nms"}).err, HasSubstr("NAME=VALUE"));
  EXPECT_THAT(tune("a", {"--option", "nms=2"}).err, HasSubstr("nms is 2, expected 0..1"));
  EXPECT_THAT(tune("a", {"--option", "min-length=3"}).err, HasSubstr("given twice"));
  const auto one = run_sdmt({"tune", "--sequences", folder_ / "s1", "--option", "nms=0.3"});
  EXPECT_EQ(one.exit_code, 2);
  EXPECT_THAT(one.err, HasSubstr("one is left out"));
}

}  // namespace
}  // namespace sdmt::tests
