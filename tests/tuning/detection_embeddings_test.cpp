// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/detection_embeddings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "tuning/scenes.h"

namespace sdmt::tuning {
namespace {

using testing::HasSubstr;

// Where a crop lies, and how many it was asked for.
class Places : public image::CropDescriptor {
 public:
  std::string name() const override { return "places"; }
  int dimension() const override { return 2; }
  std::optional<double> tau_a() const override { return threshold; }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    out.reset(crops.size(), 2);
    for (std::size_t i = 0; i < crops.size(); ++i) {
      out.row(i)[0] = static_cast<float>(crops[i].rect.left);
      out.row(i)[1] = 1;
    }
    asked += crops.size();
  }

  std::optional<double> threshold = 0.5;
  std::size_t asked = 0;
};

class Embeddings : public testing::Test {
 protected:
  // Frames of one colour.
  void draw_frames() const {
    for (const std::string name : {"s1", "s2"}) {
      const std::string folder = scenes_.file(name) + "/img1";
      std::filesystem::create_directories(folder);
      for (int frame = 1; frame <= Scenes::kFrames; ++frame) {
        const std::string number = std::to_string(frame);
        tests::write_file(folder + "/" + std::string(6 - number.size(), '0') + number + ".ppm",
                          "P6 320 180 255\n" + std::string(3 * 320 * 180, 'x'));
      }
    }
  }
  std::string refusal(TuningPlan plan) {
    try {
      embed_detections(plan, places_, [](int) {});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  }
  Scenes scenes_;
  Places places_;
};

TEST_F(Embeddings, OfStrongBoxesOnly) {
  draw_frames();
  TuningPlan plan = make_plan(scenes_.options(), {});
  int frames = 0;
  embed_detections(plan, places_, [&](int done) { frames = done; });
  EXPECT_EQ(frames, plan.frames());
  EXPECT_EQ(plan.tau_a, 0.5);
  std::size_t strong = 0;
  for (const TuningSequence& input : plan.sequences) {
    ASSERT_EQ(input.detections.dimension(), 2);
    for (int frame = 1; frame <= Scenes::kFrames; ++frame) {
      const auto boxes = input.detections.frame(frame);
      const auto vectors = input.detections.embeddings(frame);
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        const bool looked_at = boxes[i].score >= 0.6;
        strong += looked_at ? 1 : 0;
        EXPECT_EQ(vectors[2 * i], looked_at ? boxes[i].box.left - 1 : 0);
      }
    }
  }
  EXPECT_EQ(places_.asked, strong);
}

// A setting that takes weaker boxes for strong, and detectors without scores.
TEST_F(Embeddings, OfAllThatSomeSettingLooksAt) {
  draw_frames();
  TuningOptions options = scenes_.options();
  options.tuned = {{"strong-confidence", {"0.3"}}};
  track::TrackerOptions base;
  base.appearance.tau_a = 0.75;
  TuningPlan plan = make_plan(options, base);
  const std::size_t boxes =
      plan.sequences[0].detections.size() + plan.sequences[1].detections.size();
  embed_detections(plan, places_, [](int) {});
  EXPECT_EQ(places_.asked, boxes);
  EXPECT_EQ(plan.tau_a, 0.75);

  base.input.use_scores = false;
  plan = make_plan(scenes_.options(), base);
  embed_detections(plan, places_, [](int) {});
  EXPECT_EQ(places_.asked, 2 * boxes);
}

TEST_F(Embeddings, SaysWhatCannotBe) {
  EXPECT_THAT(refusal(make_plan(scenes_.options(), {})),
              HasSubstr("s1: the sequence has no frames to see people on"));
  draw_frames();
  TuningOptions options = scenes_.options();
  options.tuned.push_back({"boosting", {"on"}});
  EXPECT_THAT(refusal(make_plan(options, {})), HasSubstr("boosting is on, expected off"));
  places_.threshold.reset();
  EXPECT_THAT(refusal(make_plan(scenes_.options(), {})), HasSubstr("places has no tau_a"));
}

}  // namespace
}  // namespace sdmt::tuning
