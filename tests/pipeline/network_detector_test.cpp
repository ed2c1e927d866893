// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/network_detector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <filesystem>

#include "cli/run_command.h"
#include "pipeline/made_network.h"
#include "sdmt/media/image_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"

namespace sdmt::pipeline {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class NetworkDetectors : public testing::Test {
 protected:
  /// What is said about a file that is refused.
  std::string refusal(const NetworkOptions& options) {
    try {
      const NetworkDetector detector(options);
      return "nothing";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  }
  NetworkOptions made(const std::string& classes = "person") {
    return {.file = tests::make_darknet(folder_.path()), .classes = mot::ClassFilter(classes)};
  }

  tests::TemporaryFolder folder_;
};

// Grey, with a red and a blue block.
Frame two_blocks(int width, int height, std::uint8_t brightness = 255) {
  Frame frame;
  frame.number = 1;
  frame.image = image::Image(width, height);
  std::fill(frame.image.bgr.begin(), frame.image.bgr.end(), 90);
  const auto paint = [&](int left, int top, int channel) {
    for (int y = top; y < top + 16; ++y) {
      for (int x = left; x < left + 16; ++x) {
        for (int c = 0; c < 3; ++c) {
          frame.image.bgr[3 * (y * width + x) + c] = c == channel ? brightness : 0;
        }
      }
    }
  };
  paint(48, 32, 2);
  paint(96, 32, 0);
  return frame;
}

TEST_F(NetworkDetectors, PutsBoxesWhereTheFrameHasThem) {
  // Twice as wide as the input, whose 64 x 64 pixels have their proportions; the third of them
  // leaves grey below.
  for (const auto& [width, height] : {std::pair{128, 128}, {256, 64}, {256, 56}, {128, 256}}) {
    NetworkOptions options = made();
    options.size = height == 256 ? 96 : 0;
    NetworkDetector detector(options);
    const auto people = detector.detect(two_blocks(width, height));
    ASSERT_EQ(people.size(), 1u) << width << " x " << height;
    EXPECT_EQ(people[0].box, (mot::Tlwh{49, 17, 16, 48}));
    EXPECT_GT(people[0].score, 0.99);
  }
  EXPECT_THAT(NetworkDetector(made()).description(), "Darknet region, 64 x 64");
}

TEST_F(NetworkDetectors, TakesTheClassesThatAreWanted) {
  const Frame frame = two_blocks(128, 128);
  EXPECT_EQ(NetworkDetector(made("CAR")).detect(frame).at(0).box, (mot::Tlwh{97, 17, 16, 48}));
  EXPECT_EQ(NetworkDetector(made("1")).detect(frame).size(), 1u);
  EXPECT_EQ(NetworkDetector(made("all")).detect(frame).size(), 2u);
  EXPECT_THAT(refusal(made("dog")), HasSubstr("none of its 2 classes, 'person' ... is wanted"));
}

// OpenCV itself drops what Darknet's yolo layers give a score below 0.2.
TEST_F(NetworkDetectors, HasWeakBoxesToo) {
  constexpr std::uint8_t kDark = 122;
  const double half = 1 / (1 + std::exp(10 - 20 * kDark / 255.0));
  NetworkDetector detector(made());
  const auto people = detector.detect(two_blocks(128, 128, kDark));
  ASSERT_EQ(people.size(), 1u);
  EXPECT_NEAR(people[0].score, half * half, 1e-4);
  NetworkOptions strict = made();
  strict.min_score = 0.16;
  EXPECT_TRUE(NetworkDetector(strict).detect(two_blocks(128, 128, kDark)).empty());
}

TEST_F(NetworkDetectors, SeesMoreWithALargerInput) {
  NetworkOptions options = made();
  options.size = 128;
  NetworkDetector detector(options);
  // Four blocks of the network in one of the picture.
  EXPECT_EQ(detector.detect(two_blocks(128, 128)).size(), 2u);
}

TEST_F(NetworkDetectors, HasNoBoxesWithoutAnImage) {
  EXPECT_TRUE(NetworkDetector(made()).detect(Frame{}).empty());
}

TEST_F(NetworkDetectors, RefusesWhatIsNone) {
  const auto options = [&](const std::string& name) { return NetworkOptions{folder_ / name}; };
  tests::write_file(folder_ / "text", "1,-1,10,20,30,40,1\n");
  EXPECT_THAT(refusal(options("text")), HasSubstr("text: expected a detector network"));
  tests::write_file(folder_ / "model.pt", "PK\x03\x04");
  EXPECT_THAT(refusal(options("model.pt")), HasSubstr("Export it to ONNX"));
  EXPECT_THAT(refusal(options("none.onnx")), HasSubstr("none.onnx: cannot be opened"));
  EXPECT_THAT(refusal({folder_.path()}), HasSubstr("is a folder"));
  tests::write_file(folder_ / "empty", "");
  EXPECT_THAT(refusal(options("empty")), HasSubstr("empty: expected a detector network"));
  EXPECT_THAT(refusal({.file = "x", .size = 100}), HasSubstr("size is 100, expected a multiple"));
}

TEST_F(NetworkDetectors, RefusesUnknownHeads) {
  tests::write_file(folder_ / "other.onnx", tests::make_onnx(7));
  EXPECT_THAT(refusal({folder_ / "other.onnx"}),
              HasSubstr("its outputs are [1 x 7 x 8 x 8], expected those of YOLOX"));
}

TEST_F(NetworkDetectors, RefusesFilesThatAreCutOff) {
  const std::string onnx = tests::make_onnx(7);
  for (const std::size_t length : {onnx.size() - 1, onnx.size() / 2, std::size_t{30}}) {
    tests::write_file(folder_ / "cut.onnx", onnx.substr(0, length));
    EXPECT_THAT(refusal({folder_ / "cut.onnx"}), HasSubstr("cut.onnx: ")) << length;
  }
  const auto cfg = made().file;
  const std::string weights = tests::read_file(folder_ / "made.weights");
  tests::write_file(folder_ / "made.weights", weights.substr(0, 3000));
  EXPECT_THAT(refusal({cfg}), HasSubstr("made.weights: is 3000 bytes long, expected "));
  EXPECT_THAT(refusal({folder_ / "made.weights"}), HasSubstr("is 3000 bytes long"));
  fs::remove(folder_ / "made.weights");
  EXPECT_THAT(refusal({cfg}), HasSubstr("its weights are missing"));
}

TEST_F(NetworkDetectors, SaysInWhichFrameItFailed) {
  NetworkDetector detector({tests::make_fragile_darknet(folder_.path())});
  EXPECT_FALSE(detector.detect(two_blocks(256, 256)).empty());
  try {
    detector.detect(two_blocks(320, 240));
    FAIL() << "ran";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("fragile.cfg: the network failed in frame 1: "));
  }
}

// Networks of others, where they are: recall and precision (IoU 0.5, score 0.3) on ten frames.
TEST_F(NetworkDetectors, RealNetworksFindRealPeople) {
  const fs::path data = SDMT_DATA_DIR;
  const fs::path pets = data / "mot15/PETS09-S2L1";
  if (!fs::exists(pets) || !fs::exists(data / "detectors")) GTEST_SKIP() << data << " lacks them";
  const auto sequence = mot::Sequence::read(pets);
  const auto truth = mot::read_ground_truth(sequence.ground_truth());
  struct Network {
    const char* file;
    int size;
    const char* description;
  };
  for (const Network& network : {Network{"yolo-fastest-1.1-body/yolo-fastest-1.1_body.cfg", 512,
                                         "Darknet region, 512 x 512"},
                                 Network{"yolox-nano/yolox_nano.onnx", 0, "YOLOX, 416 x 416"},
                                 Network{"nanodet-m/nanodet_m.onnx", 0, "NanoDet, 416 x 416"}}) {
    NetworkDetector detector(
        {.file = data / "detectors" / network.file, .size = network.size, .min_score = 0.3});
    EXPECT_EQ(detector.description(), network.description);
    int people = 0, boxes = 0, found = 0;
    for (int number = 1; number <= sequence.length; number += 80) {
      Frame frame{number, media::read_image(sequence.image(number)), ""};
      omp_set_num_threads(1);
      const auto detections = detector.detect(frame);
      omp_set_num_threads(2);
      const auto again = detector.detect(frame);
      ASSERT_EQ(detections.size(), again.size());
      for (std::size_t i = 0; i < again.size(); ++i) EXPECT_EQ(detections[i].box, again[i].box);
      boxes += static_cast<int>(detections.size());
      for (const auto& row : truth) {
        if (row.frame != number || !row.keep) continue;
        ++people;
        found += std::any_of(detections.begin(), detections.end(), [&](const auto& detection) {
          return mot::iou(detection.box, row.box) >= 0.5;
        });
      }
    }
    EXPECT_GT(found, 0.88 * people) << network.file;
    EXPECT_LT(boxes, 1.8 * people) << network.file;
  }
}

}  // namespace
}  // namespace sdmt::pipeline
