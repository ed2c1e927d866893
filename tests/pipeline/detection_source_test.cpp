// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/detection_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "cli/run_command.h"

namespace sdmt::pipeline {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using tests::write_file;

class DetectionSources : public testing::Test {
 protected:
  std::unique_ptr<DetectionSource> file(const std::string& rows) {
    write_file(folder_ / "det.txt", rows);
    return open_detection_source(folder_ / "det.txt");
  }

  tests::TemporaryFolder folder_;
};

TEST_F(DetectionSources, AFileGivesTheBoxesOfEachFrame) {
  const auto source = file("1,-1,10,20,30,40,0.5\n3,-1,11,21,31,41,0.75\n");
  EXPECT_EQ(source->file(), folder_ / "det.txt");
  EXPECT_FALSE(source->needs_images());
  EXPECT_EQ(source->last_frame(), 3);
  Frame frame;
  frame.number = 2;
  EXPECT_TRUE(source->detect(frame).empty());
  frame.number = 3;
  ASSERT_EQ(source->detect(frame).size(), 1u);
  EXPECT_EQ(source->detect(frame)[0].box, (mot::Tlwh{11, 21, 31, 41}));
}

TEST_F(DetectionSources, ThePeopleDetectorLooksAtFrames) {
  const auto source = open_detection_source("hog");
  EXPECT_TRUE(source->needs_images());
  EXPECT_EQ(source->file(), "");
  EXPECT_TRUE(source->detect(Frame{}).empty());
  Frame frame;
  frame.image = image::Image(160, 200);
  EXPECT_TRUE(source->detect(frame).empty());
  EXPECT_THROW(open_detection_source("hog", {.min_person_height = 5}), std::invalid_argument);
  EXPECT_THROW(open_detection_source(folder_ / "none.txt"), std::invalid_argument);
}

TEST_F(DetectionSources, OptionsAreFittedToTheScores) {
  track::TrackerOptions options;
  options.input.use_scores = true;
  EXPECT_TRUE(fit_to_scores(options, *file("1,-1,1,1,9,9,0.5\n2,-1,1,1,9,9,1\n")).empty());
  EXPECT_TRUE(options.input.use_scores);
  EXPECT_THAT(fit_to_scores(options, *file("1,-1,1,1,9,9,0.5\n2,-1,1,1,9,9,42\n")),
              ElementsAre(HasSubstr("scores from 0.5 to 42 are no probabilities")));
  options.input.calibration.emplace();
  EXPECT_TRUE(fit_to_scores(options, *file("1,-1,1,1,9,9,0.5\n2,-1,1,1,9,9,42\n")).empty());
  EXPECT_THAT(fit_to_scores(options, *open_detection_source("hog")),
              ElementsAre(HasSubstr("the detector gives probabilities")));
  EXPECT_FALSE(options.input.calibration.has_value());
  EXPECT_THAT(fit_to_scores(options, *file("1,-1,1,1,9,9,-1\n2,-1,1,1,9,9,-1\n")),
              ElementsAre(HasSubstr("all scores are equal")));
  EXPECT_FALSE(options.input.use_scores);
}

TEST_F(DetectionSources, TheDefaultIsTheSequencesOwnFile) {
  EXPECT_EQ(default_detections(folder_.path()), "hog");
  write_file(folder_ / "seqinfo.ini", "[Sequence]\n");
  EXPECT_EQ(default_detections(folder_.path()), "hog");
  std::filesystem::create_directory(folder_ / "det");
  write_file(folder_ / "det/det.txt", "");
  EXPECT_EQ(default_detections(folder_.path()), (folder_ / "det/det.txt").string());
}

}  // namespace
}  // namespace sdmt::pipeline
