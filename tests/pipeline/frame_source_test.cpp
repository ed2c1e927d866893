// SPDX-License-Identifier: Apache-2.0
// What the inputs give: which frames, in which order, under which numbers, and what is refused.
#include "sdmt/pipeline/frame_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "cli/run_command.h"
#include "sdmt/mot/sequence.h"

namespace sdmt::pipeline {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::write_file;

class FrameSources : public testing::Test {
 protected:
  // An image that says which it is.
  void draw(const std::string& name, int value) {
    const fs::path path = folder_ / name;
    fs::create_directories(path.parent_path());
    ASSERT_TRUE(cv::imwrite(path.string(), cv::Mat(40, 60, CV_8UC3, cv::Scalar::all(value))));
  }
  // What draw() was given for each frame; -1 where there is no image.
  std::vector<int> values(const std::string& input) {
    const auto source = open_frame_source(input);
    std::vector<int> values;
    Frame frame;
    while (source->next(frame, true)) {
      EXPECT_EQ(frame.number, static_cast<int>(values.size()) + 1);
      EXPECT_NE(frame.has_image(), !frame.problem.empty());
      values.push_back(frame.has_image() ? *frame.image.pixel(5, 5) : -1);
    }
    EXPECT_EQ(source->frame_count(), static_cast<int>(values.size()));
    return values;
  }
  static std::string refusal(const std::string& input) {
    try {
      open_frame_source(input);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  }
  void sequence(const std::string& settings) {
    write_file(folder_ / "seqinfo.ini", "[Sequence]\n" + settings);
  }

  tests::TemporaryFolder folder_;
};

TEST_F(FrameSources, HiddenFilesAreNoFrames) {
  for (const int frame : {1, 2, 10}) {
    draw(std::to_string(frame) + ".png", 10 * frame);
    write_file(folder_ / ("._" + std::to_string(frame) + ".png"), "what macOS keeps beside a file");
  }
  write_file(folder_ / "notes.txt", "x");
  write_file(folder_ / "labels.json", "x");
  fs::create_directory(folder_ / "old.png");
  EXPECT_THAT(values(folder_.path()), ElementsAre(10, 20, 100));
  EXPECT_THAT(open_frame_source(folder_.path())->notes(),
              ElementsAre(folder_.path().string() +
                          ": 3 hidden files, 1 folder, 2 files that are no images (.json .txt) are "
                          "left out"));
}

TEST_F(FrameSources, AnEmptyFolderSaysWhatIsThere) {
  EXPECT_THAT(refusal(folder_.path()), HasSubstr("holds neither seqinfo.ini nor images"));
  write_file(folder_ / ".a.jpg", "x");
  fs::create_directory(folder_ / "img1");
  EXPECT_THAT(refusal(folder_.path()), HasSubstr("1 hidden file, 1 folder are left out"));
}

TEST_F(FrameSources, ALinkThatLeadsNowhereKeepsItsPlace) {
  draw("a1.png", 50);
  draw("a3.png", 70);
  fs::create_symlink("nowhere.png", folder_ / "a2.png");
  EXPECT_THAT(values(folder_.path()), ElementsAre(50, -1, 70));
}

TEST_F(FrameSources, OtherKindsOfImagesAreRead) {
  draw("1.webp", 60);
  draw("2.BMP", 80);
  draw("3.tiff", 100);
  const auto read = values(folder_.path());
  ASSERT_EQ(read.size(), 3u);
  EXPECT_NEAR(read[0], 60, 4);
  EXPECT_NEAR(read[2], 100, 4);
}

TEST_F(FrameSources, NumbersThatAreNotTheFramesAreSaid) {
  for (int i = 1; i <= 3; ++i) draw("b/frame" + std::to_string(i) + ".png", i);
  EXPECT_EQ(open_frame_source(folder_ / "b")->numbering(), "");
  for (int i = 0; i < 3; ++i) draw("c/00000" + std::to_string(i) + ".png", i);
  EXPECT_THAT(open_frame_source(folder_ / "c")->numbering(),
              HasSubstr("frame 1 is 000000.png, frame 3 is 000002.png"));
  for (const int i : {1, 2, 4}) draw("d/" + std::to_string(i) + ".png", i);
  EXPECT_THAT(open_frame_source(folder_ / "d")->numbering(), HasSubstr("frame 3 is 4.png"));
  draw("e/front.png", 1);
  EXPECT_EQ(open_frame_source(folder_ / "e")->numbering(), "");
}

TEST_F(FrameSources, ASequenceNumberedFrom0BeginsThere) {
  sequence("seqLength=3\n");
  for (int i = 0; i < 3; ++i) draw("img1/00000" + std::to_string(i) + ".jpg", 10 * i);
  EXPECT_THAT(values(folder_.path()), ElementsAre(0, 10, 20));
  EXPECT_THAT(
      open_frame_source(folder_.path())->notes(),
      ElementsAre(HasSubstr("img1: images are numbered from 0: 000000.jpg is taken as frame "
                            "1")));
  EXPECT_EQ(mot::Sequence::read(folder_.path()).image(3).filename(), "000002.jpg");
}

TEST_F(FrameSources, APieceOfASequenceKeepsItsNumbers) {
  sequence("seqLength=3\n");
  for (int i = 101; i <= 103; ++i) draw("img1/000" + std::to_string(i) + ".jpg", i);
  EXPECT_THAT(values(folder_.path()), ElementsAre(101, 102, 103));
  EXPECT_THAT(open_frame_source(folder_.path())->notes(), ElementsAre(HasSubstr("from 101")));
}

TEST_F(FrameSources, GapsInASequenceAreUnreadableFrames) {
  sequence("");
  for (const int i : {2, 3, 6}) draw("img1/00000" + std::to_string(i) + ".jpg", 10 * i);
  EXPECT_THAT(values(folder_.path()), ElementsAre(-1, 20, 30, -1, -1, 60));
  EXPECT_TRUE(open_frame_source(folder_.path())->notes().empty());
}

TEST_F(FrameSources, OtherNamesOfASequencesImagesAreFound) {
  sequence("seqLength=2\nimExt=.jpg\n");
  draw("img1/00000001.png", 10);
  draw("img1/00000002.png", 20);
  write_file(folder_ / "img1/00000001.txt", "labels");
  write_file(folder_ / "img1/._00000003.jpg", "what macOS keeps beside a file");
  EXPECT_THAT(values(folder_.path()), ElementsAre(10, 20));
  fs::remove_all(folder_ / "img1");
  draw("img1/frame_9.jpg", 90);
  draw("img1/frame_10.jpg", 100);
  EXPECT_THAT(values(folder_.path()), ElementsAre(90, 100));
}

TEST_F(FrameSources, WhatWasMeantIsSaid) {
  EXPECT_EQ(refusal("0"), "0: does not exist; a camera is camera:0");
  EXPECT_EQ(refusal("/dev/video7"), "/dev/video7: does not exist; a camera is camera:7");
  EXPECT_EQ(refusal("img1/%06d.jpg"),
            "img1/%06d.jpg: does not exist; give the folder of the images, img1");
  EXPECT_EQ(refusal("*.jpg"), "*.jpg: does not exist; give the folder of the images, .");
  EXPECT_THAT(refusal("/dev/null"), HasSubstr("is not a regular file"));
  ASSERT_EQ(::mkfifo((folder_ / "pipe.mp4").c_str(), 0600), 0);  // opening it would never return
  EXPECT_THAT(refusal(folder_ / "pipe.mp4"), HasSubstr("is not a regular file"));
}

TEST_F(FrameSources, WhatFfmpegWouldPlayButIsNoVideoIsRefused) {
  std::string rows;
  for (int i = 1; i < 400; ++i) rows += std::to_string(i) + ",-1,10,20,30,40,0.9\n";
  write_file(folder_ / "det.txt", rows);
  EXPECT_THAT(refusal(folder_ / "det.txt"), HasSubstr("is a text, not a video"));
  write_file(folder_ / "art.nfo", "\x1B[31mcolours\x1B[0m\r\n" + rows);
  EXPECT_THAT(refusal(folder_ / "art.nfo"), HasSubstr("is a text"));
  write_file(folder_ / "p.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'/>");
  EXPECT_THAT(refusal(folder_ / "p.svg"), HasSubstr("is a text"));
  for (const std::string magic : {"ID3\x04", "fLaC", "    ftypM4A "}) {  // with a cover picture
    write_file(folder_ / "song", magic + std::string(100, '\x01'));
    EXPECT_THAT(refusal(folder_ / "song"), HasSubstr("is sound")) << magic;
  }
  write_file(folder_ / "empty.mp4", "");
  EXPECT_THAT(refusal(folder_ / "empty.mp4"), HasSubstr("is empty"));
  for (const std::string name : {"a.jpg", "a.png", "a.bmp", "a.webp", "a.tif"}) {
    draw(name, 20);
    EXPECT_THAT(refusal(folder_ / name), HasSubstr("is a single picture")) << name;
  }
}

TEST(DisplayName, HidesWhatOpensTheDoor) {
  EXPECT_EQ(display_name("rtsp://host/stream"), "rtsp://host/stream");
  EXPECT_EQ(display_name("rtsp://admin:hunter2@host/stream"), "rtsp://***@host/stream");
  EXPECT_EQ(display_name("rtsp://admin:p@ss/w?rd@host/stream"), "rtsp://***@host/stream");
  EXPECT_EQ(display_name("http://host/video.cgi?user=admin&pwd=hunter2"),
            "http://host/video.cgi?***");
  EXPECT_EQ(display_name("me@home/video.mp4"), "me@home/video.mp4");
}

}  // namespace
}  // namespace sdmt::pipeline
