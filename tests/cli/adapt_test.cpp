// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/run_command.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;
using Words = std::vector<std::string>;

// A network that learns in seconds.
constexpr const char* kSmall =
    R"({"name": "small", "input": {"height": 32, "width": 16}, "layers": [
  {"name": "conv1", "type": "Conv2d", "out_channels": 16, "kernel_size": 3, "padding": 1},
  {"name": "relu1", "type": "ReLU"}, {"name": "pool1", "type": "MaxPool2d"},
  {"name": "conv2", "type": "Conv2d", "out_channels": 32, "kernel_size": 3, "padding": 1},
  {"name": "bn2", "type": "BatchNorm2d"},
  {"name": "relu2", "type": "ReLU"}, {"name": "pool2", "type": "MaxPool2d"},
  {"name": "fc", "type": "Linear", "out_features": 32}, {"name": "unit", "type": "L2Normalize"}]})";

class Adapt : public testing::Test {
 protected:
  Adapt() {
    write_file(folder_ / "small.json", kSmall);
    made(run_sdmt({"init-model", "--architecture", folder_ / "small.json", "--output", start()}));
  }
  static void made(const CommandResult& result) { ASSERT_EQ(result.exit_code, 0) << result.err; }

  std::string start() const { return folder_ / "start"; }
  std::string output() const { return folder_ / "adapted"; }
  std::string scene(const std::string& name, int frames, int walkers) const {
    made(run_sdmt({"synth", "scene", "--output", folder_ / name, "--frames", std::to_string(frames),
                   "--walkers", std::to_string(walkers), "--width", "480", "--height", "270",
                   "--frame-rate", "10"}));
    return folder_ / name;
  }
  CommandResult adapt(const std::string& input, const Words& more = {}) const {
    return run_sdmt(words(input, more), {{"SOURCE_DATE_EPOCH", "0"}});
  }
  Words words(const std::string& input, const Words& more) const {
    Words all{"adapt", "--model",         start(),    "--output",          output(),
              input,   "--no-appearance", "--config", "detector-synthetic"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  bool has_output() const { return std::filesystem::exists(output()); }

  TemporaryFolder folder_;
};

nlohmann::json json_of(const std::filesystem::path& path) {
  return nlohmann::json::parse(read_file(path));
}

TEST_F(Adapt, GainsOnTheSceneAsItsGroundTruthAgrees) {
  const std::string plaza = scene("plaza", 400, 10);
  const auto result =
      adapt(plaza, {"--lr", "0.001", "--json", folder_ / "report.json", "--threads", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("plaza: 400 frames"));
  const auto report = json_of(folder_ / "report.json");
  EXPECT_TRUE(report["gained"]);
  const double before = report["before"]["auc"], after = report["after"]["auc"];
  EXPECT_GT(after, before);

  // The part held out, by who is really there.
  const auto truth = [&](const std::string& model) {
    made(run_sdmt({"validate-roc", "--model", model, "--data", plaza, "--frames", "281-",
                   "--frame-step", "4", "--json", folder_ / "truth.json"}));
    return json_of(folder_ / "truth.json");
  };
  const auto true_before = truth(start()), true_after = truth(output());
  EXPECT_GT(true_after["person_only"]["auc"], true_before["person_only"]["auc"]);
  EXPECT_LT(true_after["person_only"]["fpr_at_tpr"]["0.7"],
            true_before["person_only"]["fpr_at_tpr"]["0.7"]);
  // People half hidden by trees are among these crops and not among those.
  EXPECT_NEAR(true_after["person_only"]["auc"], after, 0.15);
  EXPECT_NEAR(true_after["at_stored_tau_a"]["tau_a"], report["after"]["tau_a"], 1e-9);

  const auto shown = run_sdmt({"inspect", output()});
  EXPECT_THAT(shown.out, HasSubstr("adapted        from start to plaza, 1970-01-01 00:00 UTC"));
  EXPECT_THAT(shown.out, HasSubstr("tau_a"));

  // Once more on one thread.
  const std::string bytes = read_file(output());
  ASSERT_EQ(adapt(plaza, {"--lr", "0.001", "--threads", "1"}).exit_code, 0);
  EXPECT_TRUE(read_file(output()) == bytes);
}

TEST_F(Adapt, RefusesScenesThatTeachNothing) {
  const auto refused = [&](const CommandResult& result, const std::string& why) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(has_output());
  };
  refused(adapt(scene("alone", 200, 1)), "tracks of people who were seen together, expected");
  const std::string empty = scene("empty", 60, 1);
  write_file(empty + "/det/det.txt", "");
  refused(adapt(empty), "the part that teaches has 0 tracks");
  refused(adapt(empty, {"--frames", "40-20"}), "--frames is '40-20', expected A-B, A- or -B");
  refused(adapt(empty, {"--frames", "61-"}), "has no frame 61");
  refused(adapt("camera:0"), "is looked at twice");
  refused(adapt(empty, {"--anchor", folder_ / "none"}), "none: no such folder");
  refused(adapt(empty, {"--anchor", empty}), "holds no .jpg or .png image, but 3 folders");
  // What is passed over is told.
  write_file(empty + "/img1/Thumbs.db", "");
  const auto passed_over = adapt(empty, {"--anchor", empty + "/img1"});
  refused(passed_over, "the part that teaches has 0 tracks");
  EXPECT_THAT(passed_over.out, HasSubstr("left out: 1 neither .jpg nor .png"));
  write_file(empty + "/img1/000007.jpg", "");
  refused(adapt(empty, {"--anchor", empty + "/img1"}), "1 of 60 images cannot be read");
  refused(run_sdmt({"adapt", "--model", start(), "--output", start(), empty}),
          "is read as --model");
}

TEST_F(Adapt, WritesNothingWhereNothingIsGained) {
  const std::string plaza = scene("plaza", 300, 10);
  for (int frame = 50; frame < 60; ++frame) {
    write_file(plaza + "/img1/0000" + std::to_string(frame) + ".jpg", "no picture");
  }
  const auto result = adapt(plaza, {scene("yard", 120, 6), "--detections", "det.txt", "--lr",
                                    "1e-9", "--iterations", "1"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("plaza: 300 frames"));
  EXPECT_THAT(result.out, HasSubstr("yard: 120 frames"));
  EXPECT_THAT(result.err, HasSubstr(".jpg: not a readable image; nobody is cut out of it"));
  EXPECT_THAT(result.err, HasSubstr("nothing was gained on the part held out"));
  EXPECT_FALSE(has_output());
}

TEST_F(Adapt, ASignalLeavesNothing) {
  const std::string plaza = scene("plaza", 300, 10);
  Process process(sdmt_words(words(plaza, {"--iterations", "100000", "--lr", "1e-5"})));
  while (!process.read_line().starts_with("plaza: 300 frames")) {
  }
  process.send_signal(SIGINT);
  const auto result = process.wait();
  EXPECT_EQ(result.exit_code, 128 + SIGINT);
  EXPECT_THAT(folder_.listing(), testing::Not(testing::Contains(HasSubstr("adapted"))));
}

}  // namespace
}  // namespace sdmt::tests
