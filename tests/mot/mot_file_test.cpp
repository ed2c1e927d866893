// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/mot_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

namespace sdmt::mot {
namespace {

namespace fs = std::filesystem;
using ::testing::EndsWith;
using ::testing::HasSubstr;

class MotFile : public ::testing::Test {
 protected:
  fs::path write(const std::string& text) {
    const fs::path path = temporary("det.txt");
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }

  // Tests run beside each other, each in its own process.
  static fs::path temporary(const std::string& name) {
    return fs::path(::testing::TempDir()) / (std::to_string(::getpid()) + "-" + name);
  }

  std::string detection_error(const std::string& text) {
    const fs::path path = write(text);
    try {
      DetectionFile::read(path);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "no error";
  }
};

TEST_F(MotFile, ReadsDetectionsByFrame) {
  const auto file = DetectionFile::read(
      write("1,-1,10.5,20,30,40,0.9,-1,-1,-1\n3,-1,-5,-6,7,8,-2.5\n3,-1,1,2,3,4,1e-3,0,0,0\n"));
  EXPECT_EQ(file.size(), 3u);
  EXPECT_EQ(file.last_frame(), 3);
  ASSERT_EQ(file.frame(1).size(), 1u);
  EXPECT_EQ(file.frame(1)[0].box, (Tlwh{10.5, 20, 30, 40}));
  EXPECT_EQ(file.frame(1)[0].score, 0.9);
  EXPECT_TRUE(file.frame(2).empty());
  ASSERT_EQ(file.frame(3).size(), 2u);
  EXPECT_EQ(file.frame(3)[0].score, -2.5);
  EXPECT_EQ(file.frame(3)[1].box, (Tlwh{1, 2, 3, 4}));
  for (const int outside : {-1, 0, 4, 1 << 30}) EXPECT_TRUE(file.frame(outside).empty());
}

TEST_F(MotFile, AcceptsWhatPeopleWrite) {
  const auto file = DetectionFile::read(write(
      "2, -1, 1, 1, 5, 5, 0.2\r\n\r\n 1.0 ,-1,2,2,+5,5,0.3\r\n2,-1,3,3,5,5,0.4\r\n   \n1,-1,4,4,5,"
      "5,0.5"));
  ASSERT_EQ(file.frame(1).size(), 2u);
  ASSERT_EQ(file.frame(2).size(), 2u);
  EXPECT_EQ(file.frame(1)[0].score, 0.3);  // sorted by frame, file order kept within
  EXPECT_EQ(file.frame(1)[1].score, 0.5);
  EXPECT_EQ(file.frame(2)[0].score, 0.2);
  EXPECT_EQ(file.frame(2)[1].score, 0.4);
}

TEST_F(MotFile, AnEmptyFileHasNoDetections) {
  const auto file = DetectionFile::read(write(""));
  EXPECT_EQ(file.size(), 0u);
  EXPECT_EQ(file.last_frame(), 0);
  EXPECT_TRUE(file.frame(1).empty());
  EXPECT_FALSE(file.has_scores());
}

TEST_F(MotFile, KnowsWhetherScoresSayAnything) {
  EXPECT_FALSE(DetectionFile::read(write("1,-1,1,1,5,5,-1\n2,-1,1,1,5,5,-1\n")).has_scores());
  EXPECT_TRUE(DetectionFile::read(write("1,-1,1,1,5,5,-1\n2,-1,1,1,5,5,-2\n")).has_scores());
}

TEST_F(MotFile, NamesFileLineColumnAndValue) {
  EXPECT_THAT(detection_error("1,-1,1,1,5,5,1\n\n1,-1,1,1,-3,5,1\n"),
              EndsWith("det.txt:3: width is -3, expected > 0"));
  const std::pair<const char*, const char*> cases[] = {
      {"1,-1,1,1,5,0,1", ":1: height is 0, expected > 0"},
      {"0,-1,1,1,5,5,1", ":1: frame is 0, expected >= 1"},
      {"-2,-1,1,1,5,5,1", ":1: frame is -2, expected >= 1"},
      {"1.5,-1,1,1,5,5,1", ":1: frame is 1.5, expected a whole number"},
      {"1e10,-1,1,1,5,5,1", ":1: frame is 1e+10, expected <= 2147483647"},
      {"1,-1,nan,1,5,5,1", ":1: left is nan, expected a finite number"},
      {"1,-1,1,inf,5,5,1", ":1: top is inf, expected a finite number"},
      {"1,-1,1,1,5,5,-inf", ":1: score is -inf, expected a finite number"},
      {"1,-1,1,1,5,5,1e999", ":1: score is '1e999', beyond the range of numbers"},
      {"1,-1,one,1,5,5,1", ":1: left is 'one', expected a number"},
      {"1,-1,0x10,1,5,5,1", ":1: left is '0x10', expected a number"},
      {"1,-1,,1,5,5,1", ":1: left is '', expected a number"},
      {"frame,id,x,y,w,h,score", ":1: frame is 'frame', expected a number"},
      {"1,-1,1,1,5,5", ":1: score is missing"},
      {"1", ":1: id is missing"},
      {"1;-1;1,5;1;5;5;1",
       ":1: frame is '1;-1;1', expected a number (columns are separated by "
       "commas, decimals by a point)"},
      {"1,-1,10,5,20,0,30,0,60,5,0,9",
       ":1: height is 0, expected > 0; the line has 12 columns, "
       "expected 7 to 10 (decimals take a point)"},
  };
  for (const auto& [text, message] : cases) EXPECT_THAT(detection_error(text), EndsWith(message));
  const std::string zeros(200, '\0');
  EXPECT_THAT(detection_error(zeros), HasSubstr("????...', expected a number"));
}

TEST_F(MotFile, RefusesAFrameNumberThatWouldFillTheMemory) {
  EXPECT_THAT(detection_error("1,-1,1,1,5,5,1\n2000000000,-1,1,1,5,5,1\n"),
              HasSubstr("frame 2000000000 follows frame 1"));
}

TEST_F(MotFile, MemoryGoesByRowsNotByFrameNumbers) {
  std::string text;
  for (int i = 1; i < 200; ++i) text += std::to_string(i * 9'999'999) + ",-1,10,10,20,40,0.9\n";
  struct rusage before {};
  struct rusage after {};
  ::getrusage(RUSAGE_SELF, &before);
  const auto file = DetectionFile::read(write(text));
  ::getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 10'000);  // kB
  EXPECT_EQ(file.last_frame(), 199 * 9'999'999);
  EXPECT_EQ(file.frame(2 * 9'999'999).size(), 1U);
  EXPECT_TRUE(file.frame(2 * 9'999'999 + 1).empty());
}

TEST_F(MotFile, KnowsColumnsAndClasses) {
  auto file =
      DetectionFile::read(write("1,-1,1,1,5,5,1,0\n1,-1,1,1,5,5,1,2\n2,-1,1,1,5,5,1,2.0\n"));
  EXPECT_EQ(file.columns(), 8);
  EXPECT_EQ(file.classes(), (std::map<int, std::size_t>{{0, 1}, {2, 2}}));
  for (const char* other :
       {"1,-1,1,1,5,5,1,-1,-1,-1\n", "1,-1,1,1,5,5,1\n", "1,-1,1,1,5,5,1,2.5,1,0\n"}) {
    file = DetectionFile::read(write(std::string("1,-1,1,1,5,5,1,1\n") + other));
    EXPECT_TRUE(file.classes().empty()) << other;
  }
}

TEST_F(MotFile, RefusesMissingFilesAndFolders) {
  EXPECT_THROW(DetectionFile::read("/nonexistent/det.txt"), std::invalid_argument);
  EXPECT_THROW(read_results(::testing::TempDir()), std::invalid_argument);
}

TEST_F(MotFile, ReadsGroundTruthWithAndWithoutClasses) {
  const auto rows = read_ground_truth(
      write("2,1,912,484,97,109,0,7,0.5\n1,4,1,2,3,4,1,-1,-1,-1\n1,5,1,2,3,4,1,3.2,1.5,0\n"
            "1,6,1,2,3,4,1\n1,7,1,2,3,4,1,1,1,0\n"));
  ASSERT_EQ(rows.size(), 5u);
  EXPECT_EQ(rows[0].id, 4);
  EXPECT_TRUE(rows[0].keep);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(rows[i].category, 0) << i;
  EXPECT_EQ(rows[4].frame, 2);
  EXPECT_FALSE(rows[4].keep);
  EXPECT_EQ(rows[4].category, 7);
  EXPECT_EQ(rows[4].visibility, 0.5);
}

TEST_F(MotFile, ResultsSurviveWritingAndReading) {
  const std::vector<ResultRow> rows = {{1, 3, {10.25, -2.5, 30, 70}, 1},
                                       {1, 4, {1e9, 0, 1, 2.75}, 0.5},
                                       {2, 3, {11, -3, 30, 70}, -1}};
  const fs::path path = temporary("results.txt");
  write_results(path, rows);
  const auto read = read_results(path);
  ASSERT_EQ(read.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(read[i].frame, rows[i].frame);
    EXPECT_EQ(read[i].id, rows[i].id);
    EXPECT_EQ(read[i].box, rows[i].box);
    EXPECT_EQ(read[i].confidence, rows[i].confidence);
  }
  EXPECT_EQ(format_result(rows[0]), "1,3,10.25,-2.50,30.00,70.00,1,-1,-1,-1\n");
}

TEST_F(MotFile, FormatsBoxesOfAnySize) {
  const double huge = std::numeric_limits<double>::max();
  const std::string text = format_result({1, 1, {-huge, -huge, huge, huge}, 1});
  EXPECT_EQ(text.back(), '\n');
  EXPECT_GT(text.size(), 1200u);
}

}  // namespace
}  // namespace sdmt::mot
