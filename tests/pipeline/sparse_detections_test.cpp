// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/sparse_detections.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

namespace sdmt::pipeline {
namespace {

// Says in which frames it was asked.
class Recorder : public DetectionSource {
 public:
  explicit Recorder(std::set<int>& asked) : asked_(asked) {}
  std::vector<mot::Detection> detect(const Frame& frame) override {
    asked_.insert(frame.number);
    return {{{1.0 * frame.number, 1, 10, 20}, 1}};
  }

 private:
  std::set<int>& asked_;
};

// A bright square of 16 pixels that is `x` pixels from the left.
Frame square(int number, int x) {
  Frame frame;
  frame.number = number;
  frame.image = image::Image(160, 120);
  std::fill(frame.image.bgr.begin(), frame.image.bgr.end(), 50);
  for (int y = 40; y < 56; ++y) {
    std::fill_n(frame.image.bgr.begin() + 3 * (y * 160 + x), 3 * 16, 200);
  }
  return frame;
}

TEST(SparseDetections, LooksAtEveryNthFrameWhereThingsMove) {
  std::set<int> asked;
  SparseDetections sparse(std::make_unique<Recorder>(asked), 3);
  for (int i = 1; i <= 8; ++i) {
    const auto boxes = sparse.detect(square(i, 8 * i));
    EXPECT_EQ(boxes.size(), i % 3 == 1 ? 1u : 0u) << i;
    EXPECT_EQ(sparse.looked(), i % 3 == 1) << i;
  }
  EXPECT_EQ(asked, (std::set{1, 4, 7}));
}

TEST(SparseDetections, KeepsTheBoxesWhereNothingMoves) {
  std::set<int> asked;
  SparseDetections sparse(std::make_unique<Recorder>(asked), 1);
  for (int i = 1; i <= 100; ++i) {
    const auto boxes = sparse.detect(square(i, i < 70 ? 20 : 28));
    ASSERT_EQ(boxes.size(), 1u);
    EXPECT_EQ(boxes[0].box.left, *asked.rbegin()) << i;
    EXPECT_TRUE(sparse.looked()) << i;
  }
  EXPECT_EQ(asked, (std::set{1, 51, 70}));
  EXPECT_TRUE(sparse.detect(Frame{}).empty());
  EXPECT_FALSE(sparse.looked());
}

TEST(SparseDetections, RestLongerTheLongerNothingMoves) {
  std::set<int> asked;
  SparseDetections sparse(std::make_unique<Recorder>(asked), 1);
  for (int i = 1; i <= 800; ++i) sparse.detect(square(i, i < 700 ? 20 : 28));
  EXPECT_EQ(asked, (std::set{1, 51, 151, 351, 551, 700, 750}));
}

TEST(SparseDetections, RefuseAnIntervalThatIsNone) {
  std::set<int> asked;
  EXPECT_THROW(SparseDetections(std::make_unique<Recorder>(asked), 0), std::invalid_argument);
  EXPECT_THROW(SparseDetections(std::make_unique<Recorder>(asked), 101), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::pipeline
