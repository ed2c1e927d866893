// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/output_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "sdmt/io/temporary_file.h"
#include "sdmt/io/unfinished_files.h"

namespace sdmt::io {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(OutputFileTest, AppearsOnCommit) {
  OutputFile file(folder_ / "a.txt");
  file.write("hello ");
  file.write("world");
  EXPECT_FALSE(fs::exists(folder_ / "a.txt"));
  file.commit();
  EXPECT_EQ(read(folder_ / "a.txt"), "hello world");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, KeepsTheOldFileWithoutCommit) {
  write_text_file(folder_ / "a.txt", "old");
  {
    OutputFile file(folder_ / "a.txt");
    file.write("new");
  }
  EXPECT_EQ(read(folder_ / "a.txt"), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, TakesOverWhatAKilledWriterLeft) {
  std::ofstream(folder_ / ".a.txt.sdmt-tmp") << "half of something long";
  write_text_file(folder_ / "a.txt", "new");
  EXPECT_EQ(read(folder_ / "a.txt"), "new");
  EXPECT_EQ(files(), 1U);
}

// Names of others beside ours, and what may lie at ours.

TEST_F(OutputFileTest, AProgramThatMustEndRemovesWhatIsUnfinished) {
  const TemporaryFile file(folder_ / "a.txt");
  { const TemporaryFile gone(folder_ / "b.txt"); }
  EXPECT_EQ(files(), 1U);
  remove_unfinished_files();
  EXPECT_EQ(files(), 0U);
}

TEST_F(OutputFileTest, LeavesFilesOfSimilarNamesAlone) {
  std::ofstream(folder_ / "a.txt.tmp") << "mine";
  std::ofstream(folder_ / ".a.txt.tmp") << "mine";
  write_text_file(folder_ / "a.txt", "new");
  EXPECT_EQ(read(folder_ / "a.txt.tmp"), "mine");
  EXPECT_EQ(read(folder_ / ".a.txt.tmp"), "mine");
}

TEST_F(OutputFileTest, TheTemporaryNameCannotBeAimedAtAnotherFile) {
  const fs::path victim = folder_ / "victim", temporary = folder_ / ".a.txt.sdmt-tmp";
  std::ofstream(victim) << "precious";
  const auto refused = [&] {
    EXPECT_THAT([&] { write_text_file(folder_ / "a.txt", "new"); },
                testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr("remove it")));
    EXPECT_FALSE(fs::exists(folder_ / "a.txt"));
    fs::remove(temporary);
  };
  fs::create_symlink("victim", temporary);
  refused();
  fs::create_symlink("nowhere", temporary);
  refused();
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
  ASSERT_EQ(::mkfifo(temporary.c_str(), 0600), 0);
  refused();  // and does not wait for a reader
  fs::create_directory(temporary);
  refused();
  fs::create_hard_link(victim, temporary);
  write_text_file(folder_ / "a.txt", "new");
  EXPECT_EQ(read(folder_ / "a.txt"), "new");
  EXPECT_EQ(read(victim), "precious");
}

TEST_F(OutputFileTest, ALinkStaysAndItsTargetIsReplaced) {
  fs::create_directory(folder_ / "real");
  write_text_file(folder_ / "real" / "t.txt", "old");
  fs::create_symlink("real/t.txt", folder_ / "inner");
  fs::create_symlink(folder_ / "inner", folder_ / "outer");
  write_text_file(folder_ / "outer", "new");
  EXPECT_EQ(read(folder_ / "real" / "t.txt"), "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "outer"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "inner"));
  fs::create_symlink("real/later.txt", folder_ / "dangling");
  write_text_file(folder_ / "dangling", "first");
  EXPECT_EQ(read(folder_ / "real" / "later.txt"), "first");
  fs::create_symlink("circle", folder_ / "circle");
  EXPECT_THROW(write_text_file(folder_ / "circle", "x"), std::runtime_error);
  EXPECT_EQ(files(), 5U);
}

TEST_F(OutputFileTest, KeepsPermissions) {
  const fs::path path = folder_ / "a.txt";
  write_text_file(path, "old");
  for (const auto mode : {fs::perms{0600}, fs::perms{0640}, fs::perms{0755}}) {
    fs::permissions(path, mode);
    write_text_file(path, "new");
    EXPECT_EQ(fs::status(path).permissions(), mode);
  }
}

TEST_F(OutputFileTest, TheTemporaryNameEndsAsAsked) {
  TemporaryFile file(folder_ / "clip.mp4", ".mp4");
  EXPECT_EQ(file.path(), folder_ / ".clip.mp4.sdmt-tmp.mp4");
  std::ofstream(file.path()) << "video";  // by name, as libraries do
  file.commit();
  EXPECT_EQ(read(folder_ / "clip.mp4"), "video");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, WritesMoreThanItsBuffer) {
  std::string expected;
  OutputFile file(folder_ / "a.txt");
  for (int i = 0; i < 400; ++i) {
    const std::string part(i * 11, static_cast<char>('a' + i % 26));
    file.write(part);
    expected += part;
  }
  file.commit();
  EXPECT_EQ(read(folder_ / "a.txt"), expected);
}

TEST_F(OutputFileTest, HasOneWriterAtATime) {
  {
    OutputFile first(folder_ / "a.txt");
    first.write("first");
    EXPECT_THAT([&] { OutputFile second(folder_ / "a.txt"); },
                testing::ThrowsMessage<std::runtime_error>(
                    testing::HasSubstr("a.txt: is being written by another program")));
    first.commit();
  }
  EXPECT_EQ(read(folder_ / "a.txt"), "first");
  write_text_file(folder_ / "a.txt", "second");
  EXPECT_EQ(read(folder_ / "a.txt"), "second");
}

TEST_F(OutputFileTest, MissingFolderIsBadInput) {
  EXPECT_THROW(
      {
        try {
          OutputFile file(folder_ / "none" / "a.txt");
        } catch (const std::invalid_argument& error) {
          EXPECT_THAT(error.what(), testing::HasSubstr("none does not exist"));
          throw;
        }
      },
      std::invalid_argument);
}

TEST_F(OutputFileTest, DiskFullIsAFailureThatNamesThePath) {
  OutputFile file("/dev/full");
  file.write("x");
  try {
    file.commit();
    FAIL() << "expected an error";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/dev/full: write failed: No space left"));
  }
}

}  // namespace
}  // namespace sdmt::io
