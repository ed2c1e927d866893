// SPDX-License-Identifier: Apache-2.0
// Videos as they are written and read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>

#include "cli/run_command.h"
#include "pipeline/file_size_limit.h"
#include "pipeline/unread_camera.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/video_output_file.h"

namespace sdmt::pipeline {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using tests::FileSizeLimit;
using tests::read_file;
using tests::TemporaryFolder;
using tests::write_file;

constexpr int kWidth = 192;
constexpr int kHeight = 96;

// Its quarters have a brightness each: 20 and 80 above, 140 and 200 below.
image::Image quarters() {
  image::Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int value = 20 + (x < kWidth / 2 ? 0 : 60) + (y < kHeight / 2 ? 0 : 120);
      std::memset(image.pixel(x, y), value, 3);
    }
  }
  return image;
}

// A frame that no encoder makes small.
image::Image noise(int seed) {
  image::Image image(kWidth, kHeight);
  std::uint32_t state = 12345U + static_cast<std::uint32_t>(seed);
  for (auto& value : image.bgr)
    value = static_cast<std::uint8_t>((state = state * 1664525U + 1013904223U) >> 24);
  return image;
}

void write_video(const fs::path& path, int frames, double rate = 25) {
  VideoOutputFile video(path, rate);
  for (int i = 0; i < frames; ++i) video.write(quarters());
  video.commit();
}

int readable_frames(const fs::path& path) {
  const auto source = open_frame_source(path);
  Frame frame;
  int count = 0;
  while (source->next(frame, true)) count += frame.has_image() ? 1 : 0;
  return count;
}

// The brightness of the quarters of the first frame, row by row, in steps as quarters() has them.
std::vector<int> shown_quarters(const fs::path& path) {
  const auto source = open_frame_source(path);
  Frame frame;
  EXPECT_TRUE(source->next(frame, true));
  std::vector<int> steps;
  for (const int y : {1, 3}) {
    for (const int x : {1, 3}) {
      steps.push_back(
          (*frame.image.pixel(frame.image.width * x / 4, frame.image.height * y / 4) - 20 + 30) /
          60);
    }
  }
  return steps;
}

// Puts the matrix of a phone into the track header; a, b, c, d as ISO/IEC 14496-12 has them.
void set_display_matrix(const fs::path& path, const std::array<int, 4>& matrix) {
  std::string bytes = read_file(path);
  const auto header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  const auto set = [&](std::size_t index, int value) {
    const auto fixed = static_cast<std::uint32_t>(value) << 16;
    for (std::size_t i = 0; i < 4; ++i) {
      bytes[header + 4 + 40 + 4 * index + i] = static_cast<char>(fixed >> (24 - 8 * i));
    }
  };
  set(0, matrix[0]);
  set(1, matrix[1]);
  set(3, matrix[2]);
  set(4, matrix[3]);
  write_file(path, bytes);
}

TEST(Video, IsShownAsAPlayerShowsIt) {
  const TemporaryFolder folder;
  // What the eye sees where the stored quarters are 0 1 / 2 3.
  const std::vector<std::pair<std::array<int, 4>, std::array<int, 4>>> cases{
      {{1, 0, 0, 1}, {0, 1, 2, 3}},   {{0, 1, -1, 0}, {2, 0, 3, 1}},   // a quarter clockwise
      {{-1, 0, 0, -1}, {3, 2, 1, 0}}, {{0, -1, 1, 0}, {1, 3, 0, 2}},   // a quarter back
      {{-1, 0, 0, 1}, {1, 0, 3, 2}},  {{1, 0, 0, -1}, {2, 3, 0, 1}},   // mirrored
      {{0, 1, 1, 0}, {0, 2, 1, 3}},   {{0, -1, -1, 0}, {3, 1, 2, 0}},  // about a diagonal
  };
  for (const std::string extension : {".mp4", ".mov"}) {
    const auto path = folder / ("phone" + extension);
    write_video(path, 3);
    for (const auto& [matrix, seen] : cases) {
      SCOPED_TRACE(testing::PrintToString(matrix));
      set_display_matrix(path, matrix);
      EXPECT_THAT(shown_quarters(path), testing::ElementsAreArray(seen));
      const auto source = open_frame_source(path);
      Frame frame;
      ASSERT_TRUE(source->next(frame, true));
      EXPECT_EQ(frame.image.width, matrix[0] != 0 ? kWidth : kHeight);
    }
  }
}

TEST(Video, OtherContainersAreUpright) {
  const TemporaryFolder folder;
  for (const std::string name : {"v.avi", "v.mkv"}) {
    write_video(folder / name, 3);
    EXPECT_THAT(shown_quarters(folder / name), ElementsAre(0, 1, 2, 3)) << name;
  }
}

TEST(Video, EveryRateAndContainerIsReadBackInFull) {
  const TemporaryFolder folder;
  for (const std::string name : {"v.mp4", "v.MOV", "v.mkv", "v.Avi"}) {
    for (const double rate : {0.1, 1.0, 29.97, 1000.0, 5000.0}) {
      if (name == "v.Avi" && rate > 1000) continue;
      SCOPED_TRACE(name + " at " + std::to_string(rate));
      write_video(folder / name, 30, rate);
      EXPECT_EQ(readable_frames(folder / name), 30);
    }
  }
  EXPECT_EQ(folder.listing().size(), 4u);
}

TEST(Video, IrregularFramesAreShownAsLongAsTheyLasted) {
  const TemporaryFolder folder;
  UnreadableFrames unreadable;
  const auto video = make_video_writer(folder / "v.avi", "camera:0", UnreadCamera(), unreadable);
  int number = 0;
  // The third falls into the picture of the second; a minute without frames is not shown.
  for (const double time : {0.0, 0.4, 0.41, 1.0, 61.0}) {
    Frame frame;
    frame.number = ++number;
    frame.image = image::Image(kWidth, kHeight);
    std::fill(frame.image.bgr.begin(), frame.image.bgr.end(),
              static_cast<std::uint8_t>(40 * number));
    video->read(frame);
    track::FinishedFrame finished;
    finished.frame = number;
    video->write(finished, {.time = time});
  }
  video->commit();
  const auto source = open_frame_source(folder / "v.avi");
  std::map<int, int> pictures;  // by brightness / 40
  Frame frame;
  for (int i = 0; source->next(frame, true); ++i) {
    EXPECT_NEAR(*frame.when.time, i / 25., 1e-3);
    ++pictures[(frame.image.bgr[0] + 20) / 40];
  }
  EXPECT_EQ(pictures, (std::map<int, int>{{1, 10}, {3, 15}, {4, 250}, {5, 1}}));
}

TEST(Video, RatesThatAreNoneAreRefused) {
  const TemporaryFolder folder;
  for (const double rate : {0.0, -1.0, 0.05, 5001.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(VideoOutputFile(folder / "v.mp4", rate), std::invalid_argument) << rate;
  }
  EXPECT_THROW(VideoOutputFile(folder / "v.avi", 1001), std::invalid_argument);
  EXPECT_THROW(VideoOutputFile(folder / "v.txt", 25), std::invalid_argument);
  EXPECT_THROW(VideoOutputFile(folder / "none/v.mp4", 25), std::invalid_argument);
  EXPECT_THAT(folder.listing(), IsEmpty());
}

TEST(Video, WhatAKilledRunLeftIsTakenOver) {
  const TemporaryFolder folder;
  std::string leftover;
  {
    VideoOutputFile video(folder / "v.mkv", 25);
    video.write(quarters());
    leftover = folder.listing().at(0);
  }
  EXPECT_THAT(folder.listing(), IsEmpty());
  write_file(folder / leftover, "of a killed run");
  write_video(folder / "v.mkv", 5);
  EXPECT_THAT(folder.listing(), ElementsAre("v.mkv"));
  EXPECT_EQ(readable_frames(folder / "v.mkv"), 5);
}

TEST(Video, ALinkInTheWayIsNotFollowed) {
  const TemporaryFolder folder;
  std::string temporary;
  {
    VideoOutputFile video(folder / "v.mkv", 25);
    temporary = folder.listing().at(0);
  }
  write_file(folder / "precious", "kept");
  fs::create_symlink("precious", folder / temporary);
  EXPECT_THROW(write_video(folder / "v.mkv", 5), std::runtime_error);
  EXPECT_EQ(read_file(folder / "precious"), "kept");
}

// Writes frames until the medium is full; returns the message, or "" when it was not.
std::string fill(const fs::path& path, int frames) {
  try {
    VideoOutputFile video(path, 25);
    for (int i = 0; i < frames; ++i) video.write(noise(i));
    video.commit();
  } catch (const std::runtime_error& error) {
    EXPECT_FALSE(fs::exists(path));
    return error.what();
  }
  EXPECT_EQ(readable_frames(path), frames);
  return "";
}

TEST(Video, AFileThatMayNotGrowIsAFailure) {
  const TemporaryFolder folder;
  constexpr int kFrames = 40;
  for (const std::string name : {"v.mp4", "v.mov", "v.mkv", "v.avi"}) {
    for (const rlim_t limit : {0, 1000, 20000, 100000}) {
      SCOPED_TRACE(name + " " + std::to_string(limit));
      const auto start = std::chrono::steady_clock::now();
      const FileSizeLimit limited(limit);
      EXPECT_NE(fill(folder / name, kFrames), "");
      EXPECT_THAT(folder.listing(), IsEmpty());
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
    }
  }
}

TEST(Video, AFullDiskIsAFailure) {
  const TemporaryFolder folder;
  constexpr int kFrames = 12;
  for (const std::string name : {"v.mp4", "v.mkv", "v.avi"}) {
    ASSERT_EQ(fill(folder / name, kFrames), "");
    const auto needed = static_cast<std::int64_t>(fs::file_size(folder / name));
    fs::remove(folder / name);
    fs::create_directory(folder / "disk");
    int failures = 0;
    // Up to what is needed, in pages of 4 kB, closely at the end, where only an index is missing.
    for (const int part : {20, 50, 80, 90, 95, 97, 98, 99, 100, 103}) {
      SCOPED_TRACE(name + " " + std::to_string(part));
      const std::string size = "size=" + std::to_string(needed * part / 100 / 4096 * 4096);
      if (::mount("tmpfs", (folder / "disk").c_str(), "tmpfs", 0, size.c_str()) != 0) {
        GTEST_SKIP() << "a full disk needs mount(): " << std::strerror(errno);
      }
      failures += fill(folder / ("disk/" + name), kFrames) != "" ? 1 : 0;
      ::umount((folder / "disk").c_str());
    }
    EXPECT_GE(failures, 8) << name;
    fs::remove(folder / "disk");
  }
}

TEST(Video, ARecordingThatWasNeverClosedIsRefusedAtOnce) {
  const TemporaryFolder folder;
  write_video(folder / "v.mp4", 30);
  const std::string bytes = read_file(folder / "v.mp4");
  write_file(folder / "cut.mp4", bytes.substr(0, bytes.size() / 2));
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) {
    EXPECT_THROW(open_frame_source(folder / "cut.mp4"), std::invalid_argument);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Video, CamerasAreCountedFrom0) {
  for (const std::string input : {"camera:", "camera:x", "camera:-1", "camera:1000"}) {
    EXPECT_THROW(open_frame_source(input), std::invalid_argument) << input;
  }
  EXPECT_THROW(open_frame_source("camera:999"), std::runtime_error);
}

}  // namespace
}  // namespace sdmt::pipeline
