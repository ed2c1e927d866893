// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/line_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <map>
#include <stdexcept>
#include <thread>

#include "cli/run_command.h"

namespace sdmt::pipeline {
namespace {

using tests::read_file;
using tests::write_file;

class FlowingFiles : public testing::Test {
 protected:
  std::unique_ptr<LineOutput> open(const Rotation& rotation = {}) {
    return open_line_output(
        path_, Flowing{rotation, [this](const std::string& text) { told_.push_back(text); }});
  }

  tests::TemporaryFolder folder_;
  std::string path_ = folder_ / "lines.jsonl";
  std::vector<std::string> told_;
};

TEST_F(FlowingFiles, EachLineIsThereAtOnceAndTheNextRunGoesOn) {
  {
    const auto file = open();
    file->write("one\n");
    EXPECT_EQ(read_file(path_), "one\n");
    EXPECT_THROW(open(), std::runtime_error);  // one writer at a time
  }
  write_file(path_, "one\ncut o");  // as a power cut leaves it
  const auto file = open();
  file->write("two\n");
  EXPECT_EQ(read_file(path_), "one\ncut o\ntwo\n");
}

TEST_F(FlowingFiles, GiveWayWhenTheyAreLarge) {
  const auto file = open({.bytes = 1000});
  std::string all;
  for (int i = 0; i < 100; ++i) {
    const std::string line = "line " + std::to_string(i) + " of about forty bytes ........\n";
    all += line;
    file->write(line);
  }
  std::map<int, std::string> pieces;  // by the number of their first line
  for (const std::string& name : folder_.listing()) {
    const std::string piece = read_file(folder_ / name);
    EXPECT_LE(piece.size(), 1000u);
    pieces[std::stoi(piece.substr(5))] = piece;
  }
  EXPECT_GE(pieces.size(), 4u);
  std::string read;
  for (const auto& [_, piece] : pieces) read += piece;
  EXPECT_EQ(read, all);
  EXPECT_TRUE(told_.empty());
}

TEST_F(FlowingFiles, GiveWayWhenTheyAreOld) {
  const auto file = open({.seconds = 1});
  file->write("one\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(1050));
  file->write("two\n");
  EXPECT_EQ(read_file(path_), "two\n");
  const auto names = folder_.listing();
  ASSERT_EQ(names.size(), 2u);
  EXPECT_THAT(names[0], testing::MatchesRegex("lines.20......T......Z.jsonl"));
  EXPECT_EQ(read_file(folder_ / names[0]), "one\n");
}

TEST_F(FlowingFiles, AFullDiskLeavesWholeLinesAndIsTold) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{100, old.rlim_max};
  const std::string line(29, 'x');
  const auto file = open();
  setrlimit(RLIMIT_FSIZE, &small);
  for (int i = 0; i < 5; ++i) file->write(line + "\n");
  setrlimit(RLIMIT_FSIZE, &old);
  const std::string full = read_file(path_);
  std::this_thread::sleep_for(std::chrono::milliseconds(1050));
  file->write("room\n");
  std::signal(SIGXFSZ, SIG_DFL);
  const std::string three = line + "\n" + line + "\n" + line + "\n";
  EXPECT_EQ(full, three);
  EXPECT_EQ(read_file(path_), three + "room\n");
  ASSERT_EQ(told_.size(), 2u);
  EXPECT_THAT(told_[0], testing::HasSubstr("lines.jsonl: write failed, 20"));
  EXPECT_THAT(told_[1], testing::HasSubstr("; 2 lines are missing"));
}

TEST(Rotations, AreSizesOrTimes) {
  EXPECT_EQ(Rotation::parse("100MB").bytes, 100'000'000u);
  EXPECT_EQ(Rotation::parse("1.5kB").bytes, 1500u);
  EXPECT_EQ(Rotation::parse("1h").seconds, 3600);
  EXPECT_EQ(Rotation::parse("2min").seconds, 120);
  EXPECT_EQ(Rotation::parse("").bytes, 0u);
  for (const char* text : {"1", "MB", "1 h", "0s", "-1h", "1x", "1hh", "nan h", "10B"}) {
    EXPECT_THROW(Rotation::parse(text), std::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace sdmt::pipeline
