// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "sdmt.h"
#include "sdmt/nn/random.h"
#include "sdmt/reid/embedder.h"
#include "sdmt/track/tracker.h"

namespace sdmt::c {
namespace {

namespace fs = std::filesystem;

const fs::path kModel = fs::path(SDMT_TESTS_DIR).parent_path() / "models" / "sdmt-lite.safetensors";

template <typename Handle, void (*release)(Handle*)>
struct Released {
  void operator()(Handle* handle) const { release(handle); }
};
template <typename Handle, void (*release)(Handle*)>
using Owned = std::unique_ptr<Handle, Released<Handle, release>>;
using Error = Owned<sdmt_error, sdmt_error_free>;
using Model = Owned<sdmt_model, sdmt_model_free>;
using Options = Owned<sdmt_options, sdmt_options_free>;
using TrackerHandle = Owned<sdmt_tracker, sdmt_tracker_free>;

// Four people cross a noisy picture.
struct Scene {
  static constexpr int kWidth = 160, kHeight = 120, kFrames = 40, kPeople = 4;
  std::vector<std::uint8_t> pixels;
  std::vector<mot::Detection> boxes;

  explicit Scene(int frame) {
    nn::Random random(7);
    for (int i = 0; i < 3 * kWidth * kHeight; ++i) {
      pixels.push_back(static_cast<std::uint8_t>(random.uniform(0, 256)));
    }
    for (int person = 0; person < kPeople; ++person) {
      const bool seen = (frame + 5 * person) % 9 != 0;
      if (!seen) continue;
      boxes.push_back(
          {{10.0 + 30 * person + frame * (person % 2 == 0 ? 1.5 : -1), 30.0 + person, 20, 50},
           0.9 - 0.05 * person});
    }
  }
};

std::vector<track::FinishedFrame> by_cpp(image::CropDescriptor* descriptor) {
  std::vector<track::FinishedFrame> all;
  track::Tracker tracker({}, descriptor);
  const auto keep = [&](const auto& frames) {
    all.insert(all.end(), frames.begin(), frames.end());
  };
  for (int t = 1; t <= Scene::kFrames; ++t) {
    const Scene scene(t);
    const image::ImageView view{scene.pixels.data(), Scene::kWidth, Scene::kHeight,
                                3 * Scene::kWidth, image::ChannelOrder::bgr};
    keep(tracker.update(scene.boxes, &view));
  }
  keep(tracker.finish());
  return all;
}

void append(const sdmt_tracker* tracker, std::vector<track::FinishedFrame>& all) {
  for (std::size_t i = 0; i < sdmt_tracker_finished(tracker); ++i) {
    const sdmt_frame* frame = sdmt_tracker_frame(tracker, i);
    track::FinishedFrame& copy = all.emplace_back();
    copy.frame = sdmt_frame_number(frame);
    std::size_t count = 0;
    const sdmt_track* tracks = sdmt_frame_tracks(frame, &count);
    for (std::size_t k = 0; k < count; ++k) {
      const sdmt_box& box = tracks[k].box;
      copy.boxes.push_back({tracks[k].id,
                            {box.left, box.top, box.width, box.height},
                            tracks[k].score,
                            static_cast<track::BoxSource>(tracks[k].source)});
    }
  }
}

std::vector<track::FinishedFrame> by_c(const sdmt_model* model) {
  const Error error(sdmt_error_new());
  const TrackerHandle tracker(sdmt_tracker_new(nullptr, model, error.get()));
  EXPECT_NE(tracker, nullptr) << sdmt_error_text(error.get());
  std::vector<track::FinishedFrame> all;
  for (int t = 1; t <= Scene::kFrames; ++t) {
    const Scene scene(t);
    std::vector<sdmt_detection> boxes;
    for (const auto& [box, score] : scene.boxes) {
      boxes.push_back({{box.left, box.top, box.width, box.height}, score});
    }
    const sdmt_image image{scene.pixels.data(), Scene::kWidth, Scene::kHeight, 3 * Scene::kWidth,
                           SDMT_BGR};
    sdmt_input input{};
    input.size = sizeof input;
    input.detections = boxes.data();
    input.count = boxes.size();
    input.image = &image;
    EXPECT_EQ(sdmt_tracker_update(tracker.get(), &input, error.get()), SDMT_OK)
        << sdmt_error_text(error.get());
    append(tracker.get(), all);
  }
  EXPECT_EQ(sdmt_tracker_finish(tracker.get(), error.get()), SDMT_OK);
  append(tracker.get(), all);
  return all;
}

void expect_same(const std::vector<track::FinishedFrame>& a,
                 const std::vector<track::FinishedFrame>& b) {
  ASSERT_EQ(a.size(), b.size());
  std::size_t boxes = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].frame, b[i].frame);
    ASSERT_EQ(a[i].boxes.size(), b[i].boxes.size());
    for (std::size_t k = 0; k < a[i].boxes.size(); ++k, ++boxes) {
      EXPECT_EQ(a[i].boxes[k].id, b[i].boxes[k].id);
      EXPECT_EQ(a[i].boxes[k].box, b[i].boxes[k].box);
      EXPECT_EQ(a[i].boxes[k].score, b[i].boxes[k].score);
      EXPECT_EQ(a[i].boxes[k].source, b[i].boxes[k].source);
    }
  }
  EXPECT_GT(boxes, 100u);
}

TEST(CInterface, TracksAsCppDoes) {
  expect_same(by_c(nullptr), by_cpp(nullptr));
  const Model model(sdmt_model_load(kModel.c_str(), nullptr));
  ASSERT_NE(model, nullptr);
  reid::Embedder embedder(reid::load_model(kModel));
  EXPECT_EQ(sdmt_model_tau_a(model.get()), embedder.tau_a());
  expect_same(by_c(model.get()), by_cpp(&embedder));
}

TEST(CInterface, ThreadsShareAModel) {
  Model model(sdmt_model_load(kModel.c_str(), nullptr));
  ASSERT_NE(model, nullptr);
  const auto alone = by_c(model.get());
  std::vector<std::vector<track::FinishedFrame>> results(4);
  std::vector<std::thread> threads;
  for (auto& result : results) {
    threads.emplace_back([&result, shared = model.get()] { result = by_c(shared); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& result : results) expect_same(result, alone);
}

TEST(CInterface, ATrackerKeepsItsModel) {
  const Error error(sdmt_error_new());
  Model model(sdmt_model_load(kModel.c_str(), error.get()));
  const Owned<sdmt_embedder, sdmt_embedder_free> embedder(
      sdmt_embedder_new(model.get(), error.get()));
  const int dimension = sdmt_model_dimension(model.get());
  model.reset();
  const Scene scene(1);
  const sdmt_image image{scene.pixels.data(), Scene::kWidth, Scene::kHeight, 3 * Scene::kWidth,
                         SDMT_RGB};
  const sdmt_box boxes[2] = {{20, 30, 20, 50}, {1000, 30, 20, 50}};
  std::vector<float> vectors(2 * static_cast<std::size_t>(dimension), 9.0F);
  std::uint8_t valid[2] = {};
  ASSERT_EQ(
      sdmt_embedder_describe(embedder.get(), &image, boxes, 2, vectors.data(), valid, error.get()),
      SDMT_OK);
  EXPECT_EQ(valid[0], 1);
  EXPECT_EQ(valid[1], 0);
  double square = 0;
  for (int i = 0; i < dimension; ++i) square += vectors[i] * vectors[i];
  EXPECT_NEAR(square, 1, 1e-5);
  EXPECT_EQ(vectors[dimension], 0.0F);
}

// Two people stand where one stood in the frame before; only their vectors say who is who.
TEST(CInterface, GivenEmbeddingsTellPeopleApart) {
  const Error error(sdmt_error_new());
  const Options options(sdmt_options_new(error.get()));
  EXPECT_EQ(sdmt_tracker_new_embedded(options.get(), error.get()), nullptr) << "without tau-a";
  ASSERT_EQ(sdmt_options_set(options.get(), "tau-a", "0.5", error.get()), SDMT_OK);
  ASSERT_EQ(sdmt_options_set(options.get(), "nms", "1", error.get()), SDMT_OK);
  const TrackerHandle tracker(sdmt_tracker_new_embedded(options.get(), error.get()));
  ASSERT_NE(tracker, nullptr) << sdmt_error_text(error.get());
  sdmt_input input{};
  input.size = sizeof input;
  input.count = 2;
  input.dimension = 2;
  std::vector<track::FinishedFrame> all;
  for (int t = 0; t < 20; ++t) {
    const int first = t % 2;  // the order of the boxes, and where they are, changes
    const sdmt_detection boxes[2] = {{{50, 50, 40, 90}, 0.9}, {{55, 50, 40, 90}, 0.9}};
    const float vectors[4] = {first ? 3.0F : 0.0F, first ? 0.0F : 2.0F, first ? 0.0F : 3.0F,
                              first ? 2.0F : 0.0F};
    input.detections = boxes;
    input.embeddings = vectors;
    ASSERT_EQ(sdmt_tracker_update(tracker.get(), &input, error.get()), SDMT_OK)
        << sdmt_error_text(error.get());
    append(tracker.get(), all);
  }
  sdmt_tracker_finish(tracker.get(), error.get());
  append(tracker.get(), all);
  ASSERT_EQ(all.size(), 20u);
  for (const auto& frame : all) EXPECT_EQ(frame.boxes.size(), 2u);
  // Who has vector (1, 0) is at 50 in odd frames, 55 in even ones: detections, not smoothed boxes,
  // would say so exactly; the smoothed ones of two people who swap stay near the middle.
  for (const auto& frame : all) EXPECT_NEAR(frame.boxes[0].box.left, 52.5, 2.5);

  const sdmt_detection boxes[2] = {{{50, 50, 40, 90}, 0.9}, {{55, 50, 40, 90}, 0.9}};
  const float wrong[4] = {1, 0, 0, 0};
  input.detections = boxes;
  input.embeddings = wrong;
  EXPECT_EQ(sdmt_tracker_update(tracker.get(), &input, error.get()), SDMT_INVALID_ARGUMENT);
  EXPECT_NE(std::string(sdmt_error_text(error.get())).find("vector 1 has length 0"),
            std::string::npos)
      << sdmt_error_text(error.get());
}

// Every second frame is lost, or not looked at; a tracker that takes over in the middle goes on
// alike.
TEST(CInterface, TimesSkippedFramesAndSnapshots) {
  const Error error(sdmt_error_new());
  const Options options(sdmt_options_new(error.get()));
  ASSERT_EQ(sdmt_options_set(options.get(), "frame-rate", "10", error.get()), SDMT_OK);
  const auto track = [&](bool skip, int handed_over_at) {
    TrackerHandle tracker(sdmt_tracker_new(options.get(), nullptr, error.get()));
    std::vector<track::FinishedFrame> all;
    for (int t = 1; t <= Scene::kFrames; ++t) {
      const double time = 0.1 * t;
      const sdmt_detection box{{10 + 2.0 * t, 50, 20, 50}, 0.9};
      sdmt_input input{};
      input.size = sizeof input;
      input.detections = &box;
      input.count = 1;
      input.time = &time;
      const bool lost = t % 2 == 0;
      if (!lost) {
        EXPECT_EQ(sdmt_tracker_update(tracker.get(), &input, error.get()), SDMT_OK);
      } else if (skip) {
        EXPECT_EQ(sdmt_tracker_skip(tracker.get(), &time, error.get()), SDMT_OK);
      }
      if (!lost || skip) append(tracker.get(), all);
      if (t != handed_over_at) continue;
      std::size_t size = 0;
      EXPECT_EQ(sdmt_tracker_save(tracker.get(), nullptr, &size, error.get()), SDMT_OK);
      std::vector<std::uint8_t> bytes(size--);
      EXPECT_EQ(sdmt_tracker_save(tracker.get(), bytes.data(), &size, error.get()),
                SDMT_INVALID_ARGUMENT)
          << "a byte too short";
      EXPECT_EQ(sdmt_tracker_save(tracker.get(), bytes.data(), &size, error.get()), SDMT_OK);
      tracker.reset(sdmt_tracker_new(options.get(), nullptr, error.get()));
      EXPECT_EQ(sdmt_tracker_restore(tracker.get(), bytes.data(), size - 1, error.get()),
                SDMT_INVALID_ARGUMENT);
      EXPECT_EQ(sdmt_tracker_restore(tracker.get(), bytes.data(), size, error.get()), SDMT_OK)
          << sdmt_error_text(error.get());
    }
    EXPECT_EQ(sdmt_tracker_finish(tracker.get(), error.get()), SDMT_OK);
    append(tracker.get(), all);
    return all;
  };
  const auto boxes = [](const std::vector<track::FinishedFrame>& frames) {
    std::vector<double> lefts;
    for (const auto& frame : frames) {
      for (const auto& box : frame.boxes) lefts.push_back(box.id + 1000 * box.box.left);
    }
    return lefts;
  };
  const auto with_all = boxes(track(true, 0));
  EXPECT_GT(with_all.size(), 30u);
  EXPECT_EQ(boxes(track(true, 21)), with_all);
  EXPECT_EQ(boxes(track(false, 21)), boxes(track(false, 0)));
  EXPECT_EQ(track(false, 0).size(), std::size_t{Scene::kFrames} / 2);
}

void expect_refused(sdmt_status status, const Error& error, const std::string& text) {
  EXPECT_EQ(status, SDMT_INVALID_ARGUMENT);
  EXPECT_EQ(sdmt_error_status(error.get()), SDMT_INVALID_ARGUMENT);
  EXPECT_EQ(sdmt_error_text(error.get()), text);
}

// The picture jumps to and fro by more than a person is wide; every seventh frame is not looked at.
TEST(CInterface, WhatIsTrackedMovesWithTheCamera) {
  const Error error(sdmt_error_new());
  const auto track = [&](bool told) {
    const TrackerHandle tracker(sdmt_tracker_new(nullptr, nullptr, error.get()));
    std::vector<track::FinishedFrame> all;
    for (int t = 1; t <= Scene::kFrames; ++t) {
      const double jump = t % 2 == 0 ? 90 : -90;
      const sdmt_camera_motion camera{1, 0, t == 1 ? 0 : jump, 0};
      const sdmt_detection box{{100 + t + (t % 2 == 0 ? 90.0 : 0.0), 50, 30, 80}, 0.9};
      sdmt_input input{};
      input.size = sizeof input;
      input.detections = &box;
      input.count = 1;
      const sdmt_camera_motion* motion = told ? &camera : nullptr;
      EXPECT_EQ(t % 7 == 0 ? sdmt_tracker_skip_moving(tracker.get(), nullptr, motion, error.get())
                           : sdmt_tracker_update_moving(tracker.get(), &input, motion, error.get()),
                SDMT_OK)
          << sdmt_error_text(error.get());
      append(tracker.get(), all);
    }
    EXPECT_EQ(sdmt_tracker_finish(tracker.get(), error.get()), SDMT_OK);
    append(tracker.get(), all);
    return all;
  };
  int frames = 0;
  for (const auto& frame : track(true)) {
    for (const auto& box : frame.boxes) {
      EXPECT_EQ(box.id, 1);
      EXPECT_NEAR(box.box.left, 100 + frame.frame + (frame.frame % 2 == 0 ? 90 : 0), 1.5);
      ++frames;
    }
  }
  EXPECT_EQ(frames, Scene::kFrames);
  std::set<int> ids;
  for (const auto& frame : track(false)) {
    for (const auto& box : frame.boxes) ids.insert(box.id);
  }
  EXPECT_NE(ids.size(), 1u) << "not told, it is not one person";
}

TEST(CInterface, ErrorsAreTexts) {
  const Error error(sdmt_error_new());
  const Options options(sdmt_options_new(error.get()));
  expect_refused(sdmt_options_set(options.get(), "min-iou", "2", error.get()), error,
                 "min_iou is 2, expected >= 0 and < 1");
  EXPECT_EQ(sdmt_options_set(options.get(), "min-iou", "0.4", error.get()), SDMT_OK);
  EXPECT_STREQ(sdmt_error_text(error.get()), "");
  expect_refused(sdmt_options_set(options.get(), "iou", "1", error.get()), error,
                 "the tracker has no option 'iou'");
  expect_refused(sdmt_options_set(nullptr, "iou", "1", error.get()), error, "options is NULL");

  const TrackerHandle tracker(sdmt_tracker_new(options.get(), nullptr, error.get()));
  sdmt_input input{};
  expect_refused(sdmt_tracker_update(tracker.get(), &input, error.get()), error,
                 "input: size is 0, expected sizeof(sdmt_input)");
  input.size = sizeof input;
  input.count = 1;
  expect_refused(sdmt_tracker_update(tracker.get(), &input, error.get()), error,
                 "input: detections is NULL");
  sdmt_detection box{{1, 1, 20, 50}, 0.9};
  input.detections = &box;
  std::uint8_t pixel = 0;
  sdmt_image image{&pixel, 100, 1, 299, SDMT_BGR};
  input.image = &image;
  expect_refused(sdmt_tracker_update(tracker.get(), &input, error.get()), error,
                 "image: stride is 299, expected 3 * width bytes or more");
  input.image = nullptr;
  const sdmt_camera_motion none{0, 0, 0, 0};
  expect_refused(sdmt_tracker_update_moving(tracker.get(), &input, &none, error.get()), error,
                 "camera motion: zoom is 0, expected 0.1..10");
  box.score = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(sdmt_tracker_update(tracker.get(), &input, error.get()), SDMT_INVALID_ARGUMENT);
  EXPECT_EQ(sdmt_tracker_finish(tracker.get(), error.get()), SDMT_OK);
  EXPECT_EQ(sdmt_tracker_finish(tracker.get(), error.get()), SDMT_INVALID_ARGUMENT);
  EXPECT_EQ(sdmt_tracker_frame(tracker.get(), 1000), nullptr);

  EXPECT_EQ(sdmt_model_load("/no/such/file", error.get()), nullptr);
  EXPECT_EQ(sdmt_error_status(error.get()), SDMT_INVALID_ARGUMENT);
  EXPECT_EQ(sdmt_detections_read("/no/such/file", "xml", error.get()), nullptr);
  EXPECT_EQ(sdmt_model_load(nullptr, nullptr), nullptr) << "without a handle for the error";
}

TEST(CInterface, ReadsAndScores) {
  const fs::path folder = fs::path(testing::TempDir()) / "c_interface";
  fs::create_directories(folder / "gt");
  std::ofstream(folder / "gt" / "gt.txt") << "1,1,10,10,20,50,1,1,1\n2,1,11,10,20,50,1,1,1\n";
  const fs::path results = folder / "results.txt";
  std::ofstream(results) << "1,7,10,10,20,50,0.5,-1,-1,-1\n2,8,11,10,20,50,0.75,-1,-1,-1\n";

  const Error error(sdmt_error_new());
  const Owned<sdmt_detections, sdmt_detections_free> boxes(
      sdmt_detections_read(results.c_str(), nullptr, error.get()));
  ASSERT_NE(boxes, nullptr) << sdmt_error_text(error.get());
  EXPECT_EQ(sdmt_detections_last_frame(boxes.get()), 2);
  EXPECT_EQ(sdmt_detections_have_scores(boxes.get()), 1);
  std::size_t count = 0;
  const sdmt_detection* second = sdmt_detections_frame(boxes.get(), 2, &count);
  ASSERT_EQ(count, 1u);
  EXPECT_EQ(second->score, 0.75);
  EXPECT_EQ(second->box.left, 11);
  EXPECT_EQ(sdmt_detections_frame(boxes.get(), 3, &count), nullptr);
  EXPECT_EQ(count, 0u);

  const Owned<sdmt_evaluation, sdmt_evaluation_free> evaluation(
      sdmt_evaluation_new("MOT16", "trackeval", error.get()));
  ASSERT_EQ(sdmt_evaluation_add(evaluation.get(), folder.c_str(), results.c_str(), error.get()),
            SDMT_OK)
      << sdmt_error_text(error.get());
  double score = -1;
  const auto read = [&](int sequence, const char* name) {
    EXPECT_EQ(sdmt_evaluation_score(evaluation.get(), sequence, name, &score, error.get()), SDMT_OK)
        << sdmt_error_text(error.get());
    return score;
  };
  EXPECT_EQ(read(0, "IDSW"), 1);
  EXPECT_EQ(read(SDMT_COMBINED, "MOTA"), 0.5);  // 1 - 1 switch / 2 boxes
  EXPECT_EQ(read(SDMT_COMBINED, "IDF1"), 0.5);
  expect_refused(sdmt_evaluation_score(evaluation.get(), 1, "MOTA", &score, error.get()), error,
                 "sequence is 1, expected SDMT_COMBINED or below 1");
}

}  // namespace
}  // namespace sdmt::c
