// SPDX-License-Identifier: Apache-2.0
// What a person at a terminal sees: its width, help, suggestions, how much is said and where.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/track_scene.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::vector<std::vector<std::string>> kCommands{
    {}, {"track"}, {"train-embedder"}, {"synth"}, {"synth", "scene"}};

std::vector<std::string> lines(const std::string& text, char end = '\n') {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line, end);) lines.push_back(line);
  return lines;
}

std::size_t widest(const std::string& text) {
  std::size_t widest = 0;
  for (const auto& line : lines(text)) widest = std::max(widest, line.size());
  return widest;
}

std::vector<std::string> plus(std::vector<std::string> words,
                              const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// Text without blanks and line ends.
std::string letters(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\n'; });
  return text;
}

class Terminal : public TrackScene {
 protected:
  // The command at a terminal of `columns`, as one text of all it shows.
  static std::string at_terminal(int columns, const std::vector<std::string>& words) {
    std::string line = "stty cols " + std::to_string(columns) + "; " + SDMT_BINARY;
    for (const auto& word : words) line += " '" + word + "'";
    return run_command({"/usr/bin/script", "-qec", line, "/dev/null"}).out;
  }
};

TEST_F(Terminal, HelpIsWrappedAndLosesNothing) {
  for (const auto& command : kCommands) {
    const auto words = plus(command, {"--help"});
    const auto wide = run_sdmt(words, {{"COLUMNS", "1000"}});
    ASSERT_EQ(wide.exit_code, 0);
    for (const int columns : {60, 80}) {
      const auto help = run_sdmt(words, {{"COLUMNS", std::to_string(columns)}});
      EXPECT_LE(widest(help.out), columns) << help.out;
      EXPECT_EQ(letters(help.out), letters(wide.out));
    }
    EXPECT_LE(widest(run_sdmt(words).out), 80u);  // a pipe has no width
  }
}

TEST_F(Terminal, HelpCanBeAskedForByACommand) {
  for (const auto& command : kCommands) {
    const auto help = run_sdmt(plus({"help"}, command));
    EXPECT_EQ(help.exit_code, 0) << help.err;
    EXPECT_EQ(help.out, run_sdmt(plus(command, {"--help"})).out);
  }
  EXPECT_THAT(run_sdmt({"help", "trakc"}).err, HasSubstr("did you mean track?"));
}

TEST_F(Terminal, NearlyRightWordsAreRecognised) {
  const auto says = [](const std::vector<std::string>& words) {
    const auto result = run_sdmt(words);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_EQ(lines(result.err).size(), 1u) << result.err;
    return result.err;
  };
  EXPECT_THAT(says({"trakc", "x"}), HasSubstr("unknown command 'trakc'; did you mean track?"));
  EXPECT_THAT(says({"eval"}), HasSubstr("did you mean evaluate?"));
  EXPECT_THAT(says({"train", "--data", "x"}), HasSubstr("did you mean train-embedder?"));
  EXPECT_THAT(says({"synth", "sceen"}), HasSubstr("did you mean scene?"));
  EXPECT_THAT(says({"synth"}), HasSubstr("expected scene or reid"));
  EXPECT_THAT(says({"zzzzzz"}), Not(HasSubstr("did you mean")));
  // Not that something else is missing.
  EXPECT_THAT(says({"evaluate", "--gt", "x", "--result", "y"}),
              HasSubstr("there is no option --result; did you mean --results?"));
  EXPECT_THAT(says({"track", "x", "--output"}), HasSubstr("--output: its value is missing"));
  EXPECT_THAT(says({"track", "x", "--ouput=t.txt"}), HasSubstr("did you mean --output?"));
  EXPECT_THAT(says({"track", "x", "--no-boostin"}), HasSubstr("did you mean --no-boosting?"));
  EXPECT_THAT(says({"track", "x", "--frobnicate"}), Not(HasSubstr("did you mean")));
  write_file(folder_ / "c.json", R"({"min-lenght": 3})");
  EXPECT_THAT(says({"track", "x", "--stats", "--config", folder_ / "c.json"}),
              HasSubstr("did you mean --min-length?"));
}

TEST_F(Terminal, TablesFit) {
  const auto sequence = picture_sequence("a-scene-with-a-long-name", 20);
  ASSERT_EQ(track(sequence, {"--no-appearance"}).exit_code, 0);
  const std::vector<std::string> words{"evaluate", "--gt", sequence, "--results",
                                       folder_ / "tracks.txt"};
  const auto piped = run_sdmt(words);
  EXPECT_GT(widest(piped.out), 100u);
  const auto narrow = run_sdmt(words, {{"COLUMNS", "80"}});
  EXPECT_LE(widest(narrow.out), 80u) << narrow.out;
  for (const std::string column : {"HOTA", "MOTA", "IDF1", "IDs", "Frag", "GT_Dets"}) {
    EXPECT_THAT(narrow.out, HasSubstr(column));
  }
  EXPECT_THAT(at_terminal(80, words), HasSubstr("Frag"));
  for (const auto& line : lines(at_terminal(72, words))) EXPECT_LE(line.size(), 73u) << line;
}

TEST_F(Terminal, ProgressNeverWraps) {
  for (const int columns : {20, 40, 80}) {
    const auto shown =
        at_terminal(columns, {"synth", "scene", "--output", folder_ / std::to_string(columns),
                              "--frames", "40", "--width", "160", "--height", "120"});
    std::string bars = shown;
    std::replace(bars.begin(), bars.end(), '\n', '\r');
    int redrawn = 0;
    for (const auto& line : lines(bars, '\r')) {
      if (!line.starts_with("drawing")) continue;
      ++redrawn;
      EXPECT_LT(line.size(), static_cast<std::size_t>(columns)) << line;
    }
    EXPECT_GT(redrawn, 0) << shown;
  }
}

TEST_F(Terminal, QuietLeavesWarningsAndResults) {
  const auto sequence = motion_sequence("s", 40, 2);
  const std::vector<std::string> words{"track", sequence, "--no-appearance", "--output",
                                       folder_ / "t.txt"};
  EXPECT_THAT(run_sdmt(words).out, HasSubstr("40 frames"));
  const auto quiet = run_sdmt(plus(words, {"-q"}));
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_EQ(quiet.out + quiet.err, "");
  EXPECT_THAT(run_sdmt(plus(words, {"--quiet", "--stats"})).out, HasSubstr("ms/frame"));
  EXPECT_THAT(at_terminal(80, plus(words, {"-q"})), Not(HasSubstr("tracking")));
  write_file(folder_ / "s/det/far.txt", "50,-1,10,10,20,40,0.9\n");
  EXPECT_THAT(run_sdmt(plus(words, {"-q", "--detections", folder_ / "s/det/far.txt"})).err,
              HasSubstr("warning"));
}

TEST_F(Terminal, VerboseSaysWhatIsUsed) {
  const auto sequence = motion_sequence("s", 40, 2);
  const auto result = run_sdmt({"track", sequence, "--no-appearance", "--stats", "-v"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, AllOf(HasSubstr("OpenCV"), HasSubstr("threads")));
}

TEST_F(Terminal, ResultsGoToStandardOutput) {
  const auto sequence = motion_sequence("s", 40, 2);
  ASSERT_EQ(track(sequence, {"--no-appearance"}).exit_code, 0);
  const auto rows = run_sdmt({"track", sequence, "--no-appearance", "--output", "-"});
  EXPECT_EQ(rows.exit_code, 0);
  EXPECT_EQ(rows.out, tracks());
  EXPECT_THAT(rows.err, HasSubstr("40 frames"));  // what is said to people goes beside it
  EXPECT_FALSE(std::filesystem::exists("-"));

  const std::vector<std::string> words{
      "evaluate", "--gt", picture_sequence("p", 5), "--results", folder_ / "tracks.txt", "--json"};
  ASSERT_EQ(track(folder_ / "p", {"--no-appearance"}).exit_code, 0);
  const auto scores = run_sdmt(plus(words, {"-"}));
  EXPECT_EQ(scores.exit_code, 0);
  EXPECT_TRUE(nlohmann::json::parse(scores.out).contains("combined"));
  EXPECT_THAT(scores.err, HasSubstr("MOTA"));

  const auto both =
      run_sdmt({"track", sequence, "--no-appearance", "--output", "-", "--jsonl", "-"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--jsonl -: is written by --output"));
  const auto model = run_sdmt({"train-embedder", "--data", sequence, "--output", "-"});
  EXPECT_EQ(model.exit_code, 2);
  EXPECT_THAT(model.err, HasSubstr("--output is -, expected a file"));
}

TEST_F(Terminal, AReaderWhoLeavesIsNoFailureWorthAWord) {
  const auto sequence = motion_sequence("s", 3000, 3);
  const auto result =
      run_command({"/bin/sh", "-c",
                   "(\"$0\" track \"$1\" --no-appearance --output - -q; echo $? >&2) | head -n 1",
                   SDMT_BINARY, sequence});
  EXPECT_EQ(result.err, "141\n");
  EXPECT_EQ(lines(result.out).size(), 1u);
}

TEST_F(Terminal, StacksThatAreTooSmallArePassedOver) {
  if (kSanitized) GTEST_SKIP() << "the sanitizers need more";
  const auto result = run_sdmt(
      {"bench", "--architecture", "lite", "--batch", "1", "--repeat", "1", "--threads", "2"},
      {{"OMP_STACKSIZE", "16k"}});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Terminal, ThreadsThatWaitDoNotTakeTheTimeOfOthers) {
  if (kSanitized) GTEST_SKIP() << "GCC's run-time is in the binary without sanitizers alone";
  // GCC's run-time tells what it was started with.
  const auto spin_count = [](std::vector<std::string> environment) {
    std::vector<std::string> words{"/usr/bin/env", "-u", "OMP_WAIT_POLICY",
                                   "OMP_DISPLAY_ENV=verbose"};
    words.insert(words.end(), environment.begin(), environment.end());
    for (const auto& word : sdmt_words({"--version"})) words.push_back(word);
    return run_command(words).err;
  };
  if (spin_count({}).find("GOMP_SPINCOUNT") == std::string::npos) {
    GTEST_SKIP() << "another OpenMP";
  }
  EXPECT_THAT(spin_count({}), HasSubstr("GOMP_SPINCOUNT = '2000'"));
  EXPECT_THAT(spin_count({"GOMP_SPINCOUNT=77"}), HasSubstr("GOMP_SPINCOUNT = '77'"));
  EXPECT_THAT(spin_count({"OMP_WAIT_POLICY=active"}), HasSubstr("GOMP_SPINCOUNT = '3"));
}

TEST_F(Terminal, ThreadsThatTheSystemRefusesAreDoneWithout) {
  if (kSanitized) GTEST_SKIP() << "the sanitizers start a thread of their own";
  // Limits of processes do not hold for root.
  const std::string limited = "ulimit -u 1; exec \"$0\" \"$@\"";
  std::vector<std::string> words;
  if (::geteuid() == 0) {
    if (!std::filesystem::exists("/usr/bin/setpriv")) GTEST_SKIP() << "needs setpriv";
    words = {"/usr/bin/setpriv", "--reuid=65534", "--clear-groups"};
  }
  const auto result =
      run_command(plus(words, {"/bin/bash", "-c", limited, SDMT_BINARY, "bench", "--architecture",
                               "lite", "--batch", "1", "--repeat", "1", "--threads", "4"}));
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: only 1 of 4 threads can be started"));
}

}  // namespace
}  // namespace sdmt::tests
