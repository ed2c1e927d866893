// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/output_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

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
  std::ofstream(folder_ / "a.txt.tmp") << "half of something long";
  write_text_file(folder_ / "a.txt", "new");
  EXPECT_EQ(read(folder_ / "a.txt"), "new");
  EXPECT_EQ(files(), 1U);
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
