// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace sdmt::mot {
namespace {

namespace fs = std::filesystem;

class SequenceFolder : public ::testing::Test {
 protected:
  SequenceFolder() { fs::create_directories(folder_); }
  ~SequenceFolder() override { fs::remove_all(folder_); }

  void write(const std::string& text) {
    std::ofstream(folder_ / "seqinfo.ini", std::ios::binary) << text;
  }
  std::string error() {
    try {
      Sequence::read(folder_);
    } catch (const std::invalid_argument& failure) {
      return failure.what();
    }
    return "no error";
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / std::to_string(::getpid()) / "walkers";
};

TEST_F(SequenceFolder, ReadsTheInfoFile) {
  write(
      "[Sequence]\r\nname=MOT16-02\r\nimDir=frames\r\nframeRate=14.5\r\nseqLength = 600\r\n"
      "imWidth=1920\r\nimHeight=1080\r\nimExt=.png\r\nsomething=else\r\n");
  EXPECT_TRUE(Sequence::is_sequence(folder_));
  const Sequence sequence = Sequence::read(folder_);
  EXPECT_EQ(sequence.name, "MOT16-02");
  EXPECT_EQ(sequence.frame_rate, 14.5);
  EXPECT_EQ(sequence.length, 600);
  EXPECT_EQ(sequence.width, 1920);
  EXPECT_EQ(sequence.height, 1080);
  EXPECT_EQ(sequence.image(7), folder_ / "frames" / "000007.png");
  EXPECT_EQ(sequence.detections(), folder_ / "det" / "det.txt");
  EXPECT_EQ(sequence.ground_truth(), folder_ / "gt" / "gt.txt");
  EXPECT_FALSE(sequence.has_images());
  fs::create_directories(folder_ / "frames");
  std::ofstream(sequence.image(1)) << "x";
  EXPECT_TRUE(sequence.has_images());
}

TEST_F(SequenceFolder, AFolderThatCannotBeListedIsNotTakenForEmpty) {
  write("[Sequence]\nseqLength=3\n");
  EXPECT_FALSE(Sequence::read(folder_).has_images());  // there is none
  fs::create_symlink("img1", folder_ / "img1");        // a link to itself
  try {
    Sequence::read(folder_);
    FAIL() << "listed";
  } catch (const std::runtime_error& failure) {
    EXPECT_THAT(failure.what(), ::testing::HasSubstr("img1: cannot be listed: "));
  }
}

TEST_F(SequenceFolder, FillsInWhatIsMissing) {
  write("[Sequence]\n");
  const Sequence sequence = Sequence::read(folder_ / "");
  EXPECT_EQ(sequence.name, "walkers");
  EXPECT_EQ(sequence.length, 0);
  EXPECT_EQ(sequence.image(123), folder_ / "" / "img1" / "000123.jpg");
}

TEST_F(SequenceFolder, NamesTheLineThatIsWrong) {
  EXPECT_FALSE(Sequence::is_sequence(folder_));
  EXPECT_THAT(error(),
              ::testing::EndsWith("seqinfo.ini: cannot be opened: No such file or directory"));
  write("[Sequence]\nseqLength=many\n");
  EXPECT_THAT(error(),
              ::testing::EndsWith("seqinfo.ini:2: seqLength is 'many', expected a number"));
  write("frameRate=0\n");
  EXPECT_THAT(error(), ::testing::EndsWith("seqinfo.ini:1: frameRate is 0, expected > 0"));
  write("seqLength=2147483647\n");
  EXPECT_THAT(error(), ::testing::EndsWith("seqLength is 2147483647, expected <= 10000000"));
  write("imWidth=-5\n");
  EXPECT_THAT(error(), ::testing::EndsWith("seqinfo.ini:1: imWidth is -5, expected >= 0"));
}

}  // namespace
}  // namespace sdmt::mot
