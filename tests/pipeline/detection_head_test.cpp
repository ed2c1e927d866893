// SPDX-License-Identifier: Apache-2.0
// Each kind of head, with outputs written by hand: the box that they mean comes back.
#include "detection_head.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sdmt::pipeline {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr int kCells8 = 12 * 8, kCells16 = 6 * 4, kCells32 = 3 * 2, kCells64 = 2 * 1;
constexpr int kCells = kCells8 + kCells16 + kCells32;

// An output with room for its values, all of them 0.
struct Values {
  explicit Values(std::vector<int> sizes, bool is_region = false)
      : shape(std::move(sizes)), region(is_region) {
    std::size_t count = 1;
    for (const int size : shape) count *= size;
    data.assign(count, 0);
  }
  void set(int row, const std::vector<float>& values) {
    std::copy(values.begin(), values.end(), data.begin() + row * shape.back());
  }
  HeadOutput output() const { return {shape, data.data(), region}; }

  std::vector<int> shape;
  std::vector<float> data;
  bool region;
};

std::vector<Candidate> decode(const std::vector<Values>& all, const std::string& name,
                              std::vector<std::uint8_t> wanted = {1, 0}) {
  std::vector<HeadOutput> outputs;
  for (const Values& values : all) outputs.push_back(values.output());
  const auto head = DetectionHead::recognise(outputs, kWidth, kHeight);
  std::vector<Candidate> found;
  EXPECT_TRUE(head.has_value());
  if (!head) return found;
  EXPECT_EQ(head->name(), name);
  EXPECT_TRUE(head->decode(outputs, kWidth, kHeight, wanted, 0.3, found));
  if (name != "Darknet region" && name != "SSD" && name != "YOLOv10") {
    std::vector<Candidate> none;
    EXPECT_FALSE(head->decode(outputs, kWidth + 32, kHeight, wanted, 0.3, none)) << name;
  }
  return found;
}

void expect_one(const std::vector<Candidate>& found, const mot::Cxcywh& box, double score) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].box.cx, box.cx, 1e-4);
  EXPECT_NEAR(found[0].box.cy, box.cy, 1e-4);
  EXPECT_NEAR(found[0].box.width, box.width, 1e-4);
  EXPECT_NEAR(found[0].box.height, box.height, 1e-4);
  EXPECT_NEAR(found[0].score, score, 1e-6);
}

TEST(DetectionHeads, YoloxOffsetsAreThoseOfTheirCell) {
  Values raw({1, kCells, 7});
  // Cell 2, 3 of stride 16: x = (0.5 + 2) 16, y = (0.25 + 3) 16.
  raw.set(kCells8 + 3 * 6 + 2, {0.5F, 0.25F, std::log(2.0F), std::log(3.0F), 0.8F, 0.5F, 0.9F});
  expect_one(decode({raw}, "YOLOX"), {40, 52, 32, 48}, 0.4);
  expect_one(decode({raw}, "YOLOX", {0, 1}), {40, 52, 32, 48}, 0.72);
  EXPECT_TRUE(decode({raw}, "YOLOX", {0, 0}).empty());
}

TEST(DetectionHeads, YoloxBoxesAreTakenAsTheyAre) {
  Values boxes({1, kCells, 7});
  boxes.set(11, {92, 4, 5, 6, 0, 0, 0});
  boxes.set(20, {40, 52, 32, 48, 0.8F, 0.5F, 0.9F});
  expect_one(decode({boxes}, "YOLOX"), {40, 52, 32, 48}, 0.4);
}

TEST(DetectionHeads, Yolov5HasThreeBoxesACell) {
  Values boxes({1, 3 * kCells, 7});
  boxes.set(100, {40, 52, 32, 48, 0.8F, 0.5F, 0.9F});
  expect_one(decode({boxes}, "YOLOv5"), {40, 52, 32, 48}, 0.4);
}

TEST(DetectionHeads, Yolov8LiesOnItsSide) {
  Values boxes({1, 6, kCells});
  const std::vector<float> column{40, 52, 32, 48, 0.5F, 0.9F};
  for (int i = 0; i < 6; ++i) boxes.data[i * kCells + 77] = column[i];
  expect_one(decode({boxes}, "YOLOv8"), {40, 52, 32, 48}, 0.5);
}

TEST(DetectionHeads, Yolov10NamesTheClassOfEachBox) {
  Values boxes({1, 30, 6});
  boxes.set(0, {24, 28, 56, 76, 0.5F, 0});
  boxes.set(1, {24, 28, 56, 76, 0.9F, 1});
  boxes.set(2, {24, 28, 56, 76, 0.9F, 17});
  expect_one(decode({boxes}, "YOLOv10"), {40, 52, 32, 48}, 0.5);
}

// A distribution whose mean lies on one value.
void set_distances(float* to, const std::vector<int>& sides) {
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < 8; ++i) to[8 * side + i] = i == sides[side] ? 40.0F : -40.0F;
  }
}

TEST(DetectionHeads, NanoDetMeasuresToTheFourSides) {
  std::vector<Values> outputs;
  for (const int count : {kCells8, kCells16, kCells32}) {
    outputs.emplace_back(std::vector{1, count, 2});
    outputs.emplace_back(std::vector{1, count, 32});
    outputs.back().data[0] = -1;
  }
  const int cell = 3 * 6 + 2;  // of stride 16, its centre at 40, 56
  outputs[2].set(cell, {0.5F, 0.9F});
  set_distances(&outputs[3].data[32 * cell], {1, 2, 1, 1});
  expect_one(decode(outputs, "NanoDet"), {40, 48, 32, 48}, 0.5);
}

TEST(DetectionHeads, NanoDetPlusMeasuresFromTheCorner) {
  Values all({1, kCells + kCells64, 34});
  const int cell = kCells8 + 3 * 6 + 2;
  all.set(cell, {0.5F, 0.9F});
  set_distances(&all.data[34 * cell + 2], {1, 2, 1, 1});
  expect_one(decode({all}, "NanoDet-Plus"), {32, 40, 32, 48}, 0.5);
}

TEST(DetectionHeads, RegionsAndSsdCountFromNoughtToOne) {
  Values region({20, 7}, true);
  region.set(4, {0.5F, 0.25F, 0.125F, 0.5F, 0.9F, 0.5F, 0.7F});
  expect_one(decode({region, region}, "Darknet region", {0, 0, 1}).empty()
                 ? decode({region}, "Darknet region")
                 : std::vector<Candidate>(),
             {48, 16, 12, 32}, 0.5);
  Values ssd({1, 1, 3, 7});
  ssd.set(1, {0, 1, 0.5F, 0.25F, 0.25F, 0.5F, 0.75F});
  ssd.set(2, {0, 0, 0.9F, 0.25F, 0.25F, 0.5F, 0.75F});
  expect_one(decode({ssd}, "SSD", {0, 1}), {36, 32, 24, 32}, 0.5);
}

TEST(DetectionHeads, BoxesThatAreNoneAreLeftOut) {
  Values boxes({1, 6, kCells});
  for (int column = 0; column < 3; ++column) boxes.data[4 * kCells + column] = 1;
  boxes.data[2 * kCells + 1] = INFINITY;
  boxes.data[3 * kCells + 1] = 4;
  boxes.data[2 * kCells + 2] = -3;
  boxes.data[3 * kCells + 2] = 4;
  EXPECT_TRUE(decode({boxes}, "YOLOv8").empty());
}

TEST(DetectionHeads, OtherOutputsAreNotRecognised) {
  for (const std::vector<int>& shape :
       {std::vector{1, 512}, {1, 7, 8, 12}, {1, kCells + 1, 85}, {1, 4, kCells}, {2, kCells, 85}}) {
    const Values values(shape);
    const std::vector<HeadOutput> outputs{values.output()};
    EXPECT_FALSE(DetectionHead::recognise(outputs, kWidth, kHeight)) << shape[1];
  }
  EXPECT_FALSE(DetectionHead::recognise({}, kWidth, kHeight));
}

}  // namespace
}  // namespace sdmt::pipeline
