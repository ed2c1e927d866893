// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/live_detections.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>

namespace sdmt::pipeline {
namespace {

Frame numbered(int number) {
  Frame frame;
  frame.number = number;
  return frame;
}

TEST(LiveDetections, PairLinesAndFrames) {
  std::istringstream lines(
      "{\"frame\":2,\"boxes\":[[1,1,5,5]]}\n\n{\"frame\":4,\"boxes\":[[2,1,5,5],[3,1,5,5]]}\n");
  LiveDetections live(lines, "lines", {});
  EXPECT_TRUE(live.detect(numbered(1)).empty());
  EXPECT_EQ(live.detect(numbered(2)).size(), 1u);
  EXPECT_TRUE(live.detect(numbered(3)).empty());
  EXPECT_EQ(live.detect(numbered(4)).size(), 2u);
  EXPECT_FALSE(live.ended());
  EXPECT_TRUE(live.detect(numbered(5)).empty());
  EXPECT_TRUE(live.ended());
  EXPECT_EQ(live.descriptor(), nullptr);
}

TEST(LiveDetections, BringTheirVectorsAlong) {
  std::istringstream lines(
      "{\"boxes\":[],\"embeddings\":[]}\n"
      "{\"boxes\":[[2,1,5,5],[3,1,5,5]],\"embeddings\":[[2,0,0],[0,0,1]]}\n");
  LiveDetections live(lines, "lines", {});
  ASSERT_NE(live.descriptor(), nullptr);
  EXPECT_TRUE(live.detect(numbered(1)).empty());
  EXPECT_EQ(live.detect(numbered(2)).size(), 2u);
  image::DescriptorRows rows;
  const std::vector<image::Crop> crops{{{}, {2, 0, 5, 5}}, {{}, {1, 0, 5, 5}}, {{}, {7, 0, 5, 5}}};
  live.descriptor()->describe(crops, rows);
  EXPECT_EQ(rows.dimension, 3);
  EXPECT_EQ(rows.valid, (std::vector<unsigned char>{1, 1, 0}));
  EXPECT_EQ(rows.values, (std::vector<float>{0, 0, 1, 1, 0, 0, 0, 0, 0}));
}

TEST(LiveDetections, NameTheLineThatIsWrong) {
  std::istringstream lines("{\"boxes\":[]}\n{\"boxes\":[[1,2,3]]}\n");
  LiveDetections live(lines, "lines", {});
  EXPECT_TRUE(live.detect(numbered(1)).empty());
  try {
    live.detect(numbered(2));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "lines:2: boxes[0] is [1,2,3], expected [left, top, width, height]");
  }
}

}  // namespace
}  // namespace sdmt::pipeline
