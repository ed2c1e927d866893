// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include "cli/run_command.h"
#include "reid/temporary_data.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;
using Words = std::vector<std::string>;

// The head on random frozen layers: a few hundred patches, then steps that take milliseconds.
class TrainEmbedder : public testing::Test {
 protected:
  TrainEmbedder() { data_.write_people(6, 3); }

  Words words(const std::string& output, const Words& more = {}) const {
    Words all = {"train-embedder",
                 "--data",
                 data_.path(),
                 "--output",
                 folder_ / output,
                 "--freeze-trunk",
                 "--views",
                 "1",
                 "--identities",
                 "3",
                 "--instances",
                 "2",
                 "--holdout-ids",
                 "2",
                 "--iterations",
                 "20",
                 "--warmup",
                 "0",
                 "--validate-every",
                 "1",
                 "--threads",
                 "1",
                 "--checkpoint-every",
                 "4"};
    for (std::size_t i = 0; i + 1 < more.size(); i += 2) {  // in place of the option above, if any
      const auto found = std::find(all.begin(), all.end(), more[i]);
      if (found != all.end()) all.erase(found, found + 2);
      all.insert(all.end(), {more[i], more[i + 1]});
    }
    return all;
  }
  // Runs until it has said `line`, then gets the signal.
  CommandResult stopped(const std::string& output, const std::string& line, int signal) const {
    Process process(sdmt_words(words(output)));
    while (!process.read_line().starts_with(line)) {
    }
    process.send_signal(signal);
    return process.wait();
  }

  reid::TemporaryData data_;
  TemporaryFolder folder_;
};

TEST_F(TrainEmbedder, InterruptedInAnyWayItEndsInTheSameBytes) {
  const auto whole = run_sdmt(words("whole", {"--log", folder_ / "log.csv"}));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("training on 12 images of 4 people"));
  const std::string expected = read_file(folder_ / "whole");
  EXPECT_THAT(read_file(folder_ / "log.csv"), HasSubstr("\n20,"));

  ASSERT_EQ(stopped("killed", "iteration 6", SIGKILL).exit_code, 128 + SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "killed"));
  ASSERT_EQ(run_sdmt(words("killed", {"--resume", folder_ / "killed.checkpoint"})).exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "killed"), expected);

  for (const int signal : {SIGINT, SIGTERM}) {
    const auto result = stopped("signalled", "iteration 3", signal);
    EXPECT_EQ(result.exit_code, 128 + signal);
    EXPECT_THAT(result.out, HasSubstr("go on with --resume"));
    const Words resume = {"--resume", folder_ / "signalled.checkpoint", "--threads", "2"};
    ASSERT_EQ(run_sdmt(words("resumed", resume)).exit_code, 0);
    EXPECT_EQ(read_file(folder_ / "resumed"), expected);
  }
}

TEST_F(TrainEmbedder, TheReportNamesABestOnlyWhenThereWasAValidation) {
  const auto report = [&](const std::string& holdout_ids) {
    const auto file = folder_ / "report.json";
    const auto result = run_sdmt(
        words("model", {"--holdout-ids", holdout_ids, "--iterations", "2", "--json", file}));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_file(file);
  };
  EXPECT_THAT(report("2"), HasSubstr("\"mean_auc\""));
  EXPECT_THAT(report("0"), testing::Not(HasSubstr("best")));
}

TEST_F(TrainEmbedder, AFullDiskLeavesThePreviousCheckpoint) {
  ASSERT_EQ(stopped("model", "iteration 3", SIGINT).exit_code, 128 + SIGINT);
  const std::string before = read_file(folder_ / "model.checkpoint");
  // No file may grow beyond a few MB (writes then fail as on a full disk); a checkpoint is larger.
  std::string command = "trap '' XFSZ; ulimit -f 8000; exec";
  for (const std::string& word :
       sdmt_words(words("model", {"--resume", folder_ / "model.checkpoint"}))) {
    command += " '" + word + "'";
  }
  const auto result = run_command({"/bin/sh", "-c", command});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("model.checkpoint: write failed"));
  EXPECT_EQ(read_file(folder_ / "model.checkpoint"), before);
  EXPECT_EQ(folder_.listing(), Words{"model.checkpoint"});
}

TEST_F(TrainEmbedder, BadInputIsNamedAndLeavesNothing) {
  const reid::TemporaryData one, empty;
  one.write_people(1, 4);
  const auto refusal = [&](const Words& more) {
    const auto result = run_sdmt(words("model", more));
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_TRUE(folder_.listing().empty());
    return result.err;
  };
  write_file(folder_.path().string() + ".txt", "no model");
  EXPECT_THAT(refusal({"--trunk", folder_.path().string() + ".txt"}), HasSubstr(".txt"));
  EXPECT_THAT(refusal({"--tie", "8by2"}), HasSubstr("--tie: tie is '8by2'"));
  EXPECT_THAT(refusal({"--tie", "5x2"}), HasSubstr("tie is 5x2"));
  EXPECT_THAT(refusal({"--unfreeze", "conv3_1"}), HasSubstr("excludes"));
  EXPECT_THAT(refusal({"--data", empty.path()}), HasSubstr("holds no .jpg or .png image"));
  EXPECT_THAT(refusal({"--data", data_.path() / "missing"}), HasSubstr("missing"));
  EXPECT_THAT(refusal({"--margin", "-1"}), HasSubstr("--margin: margin is -1"));
  EXPECT_THAT(refusal({"--head", "pair-classifier", "--log", folder_ / "log.csv"}),
              HasSubstr("--log goes with --head metric only"));
  EXPECT_THAT(refusal({"--log", folder_ / "no/log.csv"}), HasSubstr("no/log.csv"));
  EXPECT_THAT(refusal({"--json", folder_ / "no/r.json"}), HasSubstr("no/r.json"));
  EXPECT_THAT(refusal({"--storage", "1"}), HasSubstr("'1' is none of float16, float32, int8"));
  EXPECT_THAT(refusal({"--holdout-ids", "5"}), HasSubstr("1 identities to train on"));
  std::filesystem::remove(folder_.path().string() + ".txt");
}

}  // namespace
}  // namespace sdmt::tests
