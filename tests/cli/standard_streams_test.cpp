// SPDX-License-Identifier: Apache-2.0
// Terminals that close, logs on a full disk, readers that leave: none of it may spoil a result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "cli/track_scene.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::tests {
namespace {

using testing::HasSubstr;

class StandardStreams : public TrackScene {
 protected:
  // The command of a shell, with the binary as $0 and the words as "$@".
  static CommandResult shell(const std::string& script, const std::vector<std::string>& words) {
    std::vector<std::string> all{"/bin/sh", "-c", script, SDMT_BINARY};
    all.insert(all.end(), words.begin(), words.end());
    return run_command(all);
  }
};

TEST_F(StandardStreams, MessagesNeverEndUpInAResult) {
  const auto sequence = motion_sequence("s", 40, 2);
  const std::vector<std::string> words{"track", sequence, "--no-appearance", "--output",
                                       folder_ / "t.txt"};
  ASSERT_EQ(shell("exec \"$0\" \"$@\"", words).exit_code, 0);
  const std::string expected = read_file(folder_ / "t.txt");
  // With a closed descriptor the next file that is opened gets its number.
  EXPECT_EQ(shell("exec \"$0\" \"$@\" 2>&-", words).exit_code, 0);
  EXPECT_EQ(read_file(folder_ / "t.txt"), expected);
  EXPECT_EQ(shell("exec \"$0\" \"$@\" >&-", words).exit_code, 1);  // the summary was lost
  EXPECT_EQ(read_file(folder_ / "t.txt"), expected);
}

TEST_F(StandardStreams, AFullLogEndsNothing) {
  const auto sequence = motion_sequence("s", 40, 2);
  const auto result = shell("exec \"$0\" \"$@\" 2>/dev/full",
                            {"track", sequence, "--no-appearance", "--output", folder_ / "t.txt"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_FALSE(mot::read_results(folder_ / "t.txt").empty());
  EXPECT_EQ(shell("exec \"$0\" \"$@\" 2>/dev/full", {"track", "nothing"}).exit_code, 2);
}

TEST_F(StandardStreams, OutputThatWasNotTakenIsAFailure) {
  for (const std::string words : {"--help", "track --help", "--version"}) {
    const auto result = shell("exec \"$0\" " + words + " >/dev/full", {});
    EXPECT_EQ(result.exit_code, 1) << words;
    EXPECT_THAT(result.err, HasSubstr("standard output: write failed")) << words;
  }
}

TEST_F(StandardStreams, AReaderThatLeavesEndsTheRunAndTheFilesAreWhole) {
  const auto sequence = motion_sequence("s", 20000, 3);
  const auto result =
      shell("(\"$0\" \"$@\"; echo $? >&2) | head -n 1",
            {"track", sequence, "--no-appearance", "--jsonl", "-", "--output", folder_ / "t.txt"});
  EXPECT_THAT(result.err, HasSubstr(std::to_string(128 + SIGPIPE) + "\n"));
  const auto rows = mot::read_results(folder_ / "t.txt");
  ASSERT_FALSE(rows.empty());
  EXPECT_LT(rows.back().frame, 20000);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "t.txt.tmp"));
}

TEST_F(StandardStreams, HelpForAReaderThatLeavesSaysNothing) {
  const auto result = shell("(sleep 0.1; \"$0\" track --help; echo $? >&2) | true", {});
  EXPECT_EQ(result.err, std::to_string(128 + SIGPIPE) + "\n");
}

TEST_F(StandardStreams, AClosedTerminalIsLikeCtrlC) {
  const auto sequence = motion_sequence("s", 20000, 3);
  Process process(sdmt_words(
      {"track", sequence, "--no-appearance", "--jsonl", "-", "--output", folder_ / "t.txt"}));
  process.read_line();
  process.send_signal(SIGHUP);
  EXPECT_EQ(process.wait().exit_code, 128 + SIGHUP);
  EXPECT_FALSE(mot::read_results(folder_ / "t.txt").empty());
}

TEST_F(StandardStreams, TheLargestFileAllowedIsAFailureThatLeavesNothing) {
  const auto sequence = motion_sequence("s", 2000, 3);
  const auto result = shell("ulimit -f 10; exec \"$0\" \"$@\"",
                            {"track", sequence, "--no-appearance", "--output", folder_ / "t.txt"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("t.txt: write failed: File too large"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "t.txt.tmp"));
}

TEST_F(StandardStreams, AMessageIsOneLineWhateverAPathHolds) {
  const auto result = run_sdmt({"track", folder_ / "two\nlines", "--stats"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("two lines: does not exist\n"));
}

}  // namespace
}  // namespace sdmt::tests
