// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "scene.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/result_rows.h"

namespace sdmt::track {
namespace {

using test::blank;
using test::detect;
using test::FakeDescriptor;
using test::Person;

using Frames = std::vector<std::vector<Person>>;  // [frame - 1] who the detector sees

Person walker(int frame, int look = 0, double start = 100) {
  return {{start + 2.0 * frame, 200, 40, 90}, look};
}

std::vector<FinishedFrame> track(const Frames& frames, const TrackerOptions& options,
                                 FakeDescriptor* appearance, TrackerStats* stats = nullptr,
                                 const Frames* truth = nullptr) {
  Tracker tracker(options, appearance);
  const image::ImageView image = blank();
  std::vector<FinishedFrame> all;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (appearance != nullptr) appearance->people = truth != nullptr ? (*truth)[i] : frames[i];
    for (const auto& done : tracker.update(detect(frames[i]), &image)) all.push_back(done);
  }
  for (const auto& done : tracker.finish()) all.push_back(done);
  if (stats != nullptr) *stats = tracker.stats();
  return all;
}

std::set<int> ids(const std::vector<FinishedFrame>& frames) {
  std::set<int> found;
  for (const auto& frame : frames) {
    for (const auto& box : frame.boxes) found.insert(box.id);
  }
  return found;
}

std::string text(const std::vector<FinishedFrame>& frames) {
  std::string all;
  std::vector<mot::ResultRow> rows;
  for (const auto& frame : frames) {
    append_results(frame, rows);
    for (const auto& merge : frame.merges) {
      all += std::to_string(merge.from) + ">" + std::to_string(merge.to) + "\n";
    }
  }
  for (const auto& row : rows) all += mot::format_result(row);
  return all;
}

// A crowd that comes and goes, meets, is missed and falsely seen; the same for the same seed.
Frames crowd(int frames, int people, std::uint64_t seed, Frames* truth = nullptr) {
  struct Walk {
    double x, y, vx, vy;
    int look, until, hidden = 0;
  };
  nn::Random random(seed);
  std::vector<Walk> walks;
  Frames seen;
  int next_look = 0;
  for (int frame = 0; frame < frames; ++frame) {
    while (static_cast<int>(walks.size()) < people) {
      walks.push_back({random.uniform(0, 1900), random.uniform(0, 800), random.uniform(-3, 3),
                       random.uniform(-1, 1), next_look++ % 15,
                       frame + 50 + static_cast<int>(random.below(300))});
    }
    std::vector<Person> here, detected;
    for (Walk& walk : walks) {
      walk.x += walk.vx;
      walk.y += walk.vy;
      const Person person{{walk.x, walk.y, 45, 100}, walk.look};
      here.push_back(person);
      if (walk.hidden > 0) {
        --walk.hidden;
        continue;
      }
      if (random.uniform() < 0.01) walk.hidden = 5 + static_cast<int>(random.below(40));
      if (random.uniform() < 0.05) continue;
      Person noisy = person;
      noisy.box.left += random.normal();
      noisy.box.top += random.normal();
      detected.push_back(noisy);
    }
    if (random.uniform() < 0.2) {
      detected.push_back({{random.uniform(0, 1900), random.uniform(0, 800), 45, 100}, 14});
    }
    std::erase_if(walks, [frame](const Walk& walk) { return walk.until <= frame; });
    seen.push_back(detected);
    if (truth != nullptr) truth->push_back(here);
  }
  return seen;
}

TrackerOptions paper() {
  TrackerOptions options = TrackerOptions::paper();
  options.appearance.tau_a = 0.6;
  return options;
}

TEST(Tracker, FollowsAPersonFromTheFirstFrameToTheLast) {
  Frames frames;
  for (int frame = 1; frame <= 50; ++frame) frames.push_back({walker(frame)});
  for (const TrackerOptions& options : {paper(), TrackerOptions::tuned()}) {
    TrackerStats stats;
    const auto finished = track(frames, options, nullptr, &stats);
    ASSERT_EQ(finished.size(), 50u);
    for (int frame = 1; frame <= 50; ++frame) {
      const auto& done = finished[static_cast<std::size_t>(frame) - 1];
      EXPECT_EQ(done.frame, frame);
      ASSERT_EQ(done.boxes.size(), 1u) << frame;
      EXPECT_EQ(done.boxes[0].id, 1);
      EXPECT_EQ(done.boxes[0].source, BoxSource::detected);
      EXPECT_EQ(done.boxes[0].score, 0.9);
      EXPECT_GT(iou(done.boxes[0].box, walker(frame).box), 0.9) << frame;
    }
    EXPECT_EQ(stats.frames, 50);
    EXPECT_EQ(stats.detections, 50);
    EXPECT_EQ(stats.tracklets, 1);
    EXPECT_EQ(stats.tracks, 1);
    EXPECT_EQ(stats.merges, 0);
    EXPECT_EQ(stats.embedded, 0);
  }
}

TEST(Tracker, SixDetectionsMakeATrack) {
  for (const int length : {5, 6}) {
    Frames frames;
    for (int frame = 1; frame <= length; ++frame) frames.push_back({walker(frame)});
    frames.resize(40);
    EXPECT_EQ(ids(track(frames, paper(), nullptr)).size(), length == 6 ? 1u : 0u);
  }
}

TEST(Tracker, MeanScoreMakesATrack) {
  Frames frames;
  for (int frame = 1; frame <= 10; ++frame) frames.push_back({walker(frame)});
  TrackerOptions options = paper();
  options.confidence.min_mean_confidence = 0.9;  // what the detections have
  EXPECT_EQ(ids(track(frames, options, nullptr)).size(), 1u);
  options.confidence.min_mean_confidence = 0.91;
  EXPECT_TRUE(ids(track(frames, options, nullptr)).empty());
  options.input.use_scores = false;  // every detection counts 1
  EXPECT_EQ(ids(track(frames, options, nullptr)).size(), 1u);
}

TEST(Tracker, TwoMissesEndATracklet) {
  TrackerOptions options = paper();
  options.association.enabled = false;
  for (const int missed : {1, 2}) {
    Frames frames;
    for (int frame = 1; frame <= 30; ++frame) {
      const bool seen = frame <= 15 || frame > 15 + missed;
      frames.push_back(seen ? std::vector{walker(frame)} : std::vector<Person>{});
    }
    const auto finished = track(frames, options, nullptr);
    EXPECT_EQ(ids(finished).size(), missed == 1 ? 1u : 2u);
    // The missing frame inside the tracklet is filled.
    ASSERT_EQ(finished[15].boxes.size(), missed == 1 ? 1u : 0u);
    if (missed == 1) {
      EXPECT_EQ(finished[15].boxes[0].source, BoxSource::interpolated);
      EXPECT_EQ(finished[15].boxes[0].score, 0);
    }
  }
}

TEST(Tracker, AssociationBridgesAnOcclusionAndFillsIt) {
  for (const bool by_appearance : {true, false}) {
    for (const int gap : {30, 92, 93}) {
      Frames frames;
      for (int frame = 1; frame <= 40 + gap; ++frame) {
        const bool seen = frame <= 20 || frame >= 20 + gap;
        frames.push_back(seen ? std::vector{walker(frame)} : std::vector<Person>{});
      }
      FakeDescriptor appearance;
      TrackerStats stats;
      TrackerOptions options = paper();
      options.association.by_motion = true;
      const auto finished = track(frames, options, by_appearance ? &appearance : nullptr, &stats);
      EXPECT_EQ(stats.merges, gap <= 92 ? 1 : 0) << gap;
      EXPECT_EQ(ids(finished).size(), gap <= 92 ? 1u : 2u) << gap;
      const auto& hidden = finished[20 + static_cast<std::size_t>(gap) / 2];
      ASSERT_EQ(hidden.boxes.size(), gap <= 92 ? 1u : 0u);
      if (gap <= 92) {
        EXPECT_EQ(hidden.boxes[0].source, BoxSource::interpolated);
        EXPECT_GT(iou(hidden.boxes[0].box, walker(hidden.frame).box), 0.8);
      }
    }
  }
}

TEST(Tracker, AssociationToldApartByLook) {
  Frames frames;
  for (int frame = 1; frame <= 80; ++frame) {
    if (frame > 20 && frame < 50) {
      frames.emplace_back();
    } else {
      frames.push_back({walker(frame, frame <= 20 ? 0 : 1)});
    }
  }
  FakeDescriptor appearance;
  Tracker tracker(paper(), &appearance);
  std::vector<AssociationDecision> decisions;
  tracker.on_association(
      [&](const AssociationDecision& decision) { decisions.push_back(decision); });
  const image::ImageView image = blank();
  for (const auto& people : frames) {
    appearance.people = people;
    tracker.update(detect(people), &image);
  }
  tracker.finish();
  ASSERT_FALSE(decisions.empty());
  EXPECT_EQ(decisions.back().verdict, AssociationVerdict::appearance);
  EXPECT_LT(decisions.back().affinity, 0);
  EXPECT_EQ(decisions.back().gap, 30);
  EXPECT_EQ(tracker.stats().merges, 0);
}

TEST(Tracker, AppearanceKeepsIdentitiesApartWhereMotionCannot) {
  // Two people meet, and turn back: by motion alone they swap.
  Frames frames;
  for (int frame = 1; frame <= 81; ++frame) {
    const double distance = 3.0 * std::abs(41 - frame);
    frames.push_back({{{400 - distance, 200, 60, 120}, 0}, {{400 + distance, 206, 60, 120}, 1}});
  }
  FakeDescriptor appearance;
  TrackerOptions options = paper();
  const auto left = [](const FinishedFrame& frame) {
    return frame.boxes[0].box.left < frame.boxes[1].box.left ? frame.boxes[0].id
                                                             : frame.boxes[1].id;
  };
  for (FakeDescriptor* model : {&appearance, static_cast<FakeDescriptor*>(nullptr)}) {
    const auto finished = track(frames, options, model);
    EXPECT_EQ(ids(finished).size(), 2u);
    ASSERT_EQ(finished.front().boxes.size(), 2u);
    ASSERT_EQ(finished.back().boxes.size(), 2u);
    EXPECT_EQ(left(finished.front()) == left(finished.back()), model != nullptr);
  }
}

TEST(Tracker, WeakDetectionsContinueButDoNotStartTracks) {
  TrackerOptions options;
  Tracker tracker(options);
  std::vector<FinishedFrame> all;
  for (int frame = 1; frame <= 60; ++frame) {
    const double score = frame > 20 && frame % 4 != 0 ? 0.4 : 0.9;
    std::vector<mot::Detection> detections = detect({walker(frame)}, score);
    detections.push_back({{1000, 500, 40, 90}, 0.59});
    for (const auto& done : tracker.update(detections)) all.push_back(done);
  }
  for (const auto& done : tracker.finish()) all.push_back(done);
  EXPECT_EQ(tracker.stats().tracklets, 1);
  for (const auto& frame : all) EXPECT_EQ(frame.boxes.size(), 1u) << frame.frame;
}

TEST(Tracker, LooksBackAtWeakDetectionsOnceItIsSure) {
  TrackerOptions options;
  options.motion.look_back = 8;
  const auto first_frame = [&options](bool elsewhere) {
    Tracker tracker(options);
    std::vector<FinishedFrame> all;
    for (int frame = 1; frame <= 40; ++frame) {
      std::vector<mot::Detection> detections = detect({walker(frame)}, frame < 20 ? 0.4 : 0.9);
      if (frame < 20 && elsewhere) detections[0].box.left += 60;
      for (const auto& done : tracker.update(detections)) all.push_back(done);
    }
    for (const auto& done : tracker.finish()) all.push_back(done);
    for (const auto& frame : all) {
      if (frame.boxes.empty()) continue;
      EXPECT_EQ(frame.boxes[0].source, BoxSource::detected);
      EXPECT_EQ(frame.boxes[0].score, frame.frame < 20 ? 0.4 : 0.9);
      EXPECT_NEAR(frame.boxes[0].box.left, walker(frame.frame).box.left, 2) << frame.frame;
      return frame.frame;
    }
    return 0;
  };
  EXPECT_EQ(first_frame(false), 12);
  EXPECT_EQ(first_frame(true), 20);
  options.output.delay = 0;  // frames before are out
  EXPECT_EQ(first_frame(false), 25);
  options.output.delay = OutputOptions::kAutoDelay;
  options.motion.look_back = 0;
  EXPECT_EQ(first_frame(false), 20);
}

TEST(Tracker, DuplicatesAndLowScoresAreDropped) {
  TrackerOptions options;
  options.input.min_confidence = 0.3;
  Tracker tracker(options);
  const mot::Tlwh box{100, 100, 40, 90};
  for (int frame = 0; frame < 10; ++frame) {
    tracker.update(std::vector<mot::Detection>{
        {box, 0.7}, {{103, 100, 40, 90}, 0.9}, {{700, 100, 40, 90}, 0.29}});
  }
  EXPECT_EQ(tracker.stats().suppressed, 20);
  EXPECT_EQ(tracker.stats().tracklets, 1);
}

TEST(Tracker, BoostingKeepsAPersonWhomTheDetectorMisses) {
  Frames seen, truth;
  for (int frame = 1; frame <= 60; ++frame) {
    truth.push_back({walker(frame)});
    // From frame 20 on the detector finds every second one only.
    seen.push_back(frame < 20 || frame % 2 == 0 ? truth.back() : std::vector<Person>{});
  }
  TrackerOptions options = paper();
  options.boosting.enabled = true;
  options.output.fill = FillGaps::none;
  options.appearance.tau_a = 0.8;
  FakeDescriptor appearance;
  TrackerStats stats;
  const auto finished = track(seen, options, &appearance, &stats, &truth);
  EXPECT_GE(stats.boosted, 18);
  int boosted = 0;
  for (const auto& frame : finished) {
    for (const auto& box : frame.boxes) boosted += box.source == BoxSource::boosted ? 1 : 0;
    if (frame.frame < 59) {
      EXPECT_EQ(frame.boxes.size(), 1u) << frame.frame;
    }
  }
  EXPECT_EQ(boosted, stats.boosted);
  // Never twice in a row: nobody is followed by appearance alone.
  for (std::size_t i = 40; i < 60; ++i) seen[i].clear();
  const auto lost = track(seen, options, &appearance, &stats, &truth);
  int in_a_row = 0;
  for (const auto& frame : lost) {
    in_a_row =
        !frame.boxes.empty() && frame.boxes[0].source == BoxSource::boosted ? in_a_row + 1 : 0;
    EXPECT_LE(in_a_row, 1) << frame.frame;
  }
}

TEST(Tracker, DelayChangesWhenNotWhat) {
  Frames truth;
  const Frames frames = crowd(700, 12, 21, &truth);
  for (TrackerOptions options : {paper(), TrackerOptions::tuned()}) {
    options.appearance.tau_a = 0.6;
    FakeDescriptor appearance;
    const std::string expected = text(track(frames, options, &appearance, nullptr, &truth));
    EXPECT_GT(expected.size(), 10000u);
    for (const int delay :
         {options.auto_delay(), options.auto_delay() + 1, 600, OutputOptions::kUnlimitedDelay}) {
      options.output.delay = delay;
      EXPECT_EQ(text(track(frames, options, &appearance, nullptr, &truth)), expected) << delay;
    }
  }
}

// A scene of three people with 30 % of the detections missing.
std::vector<std::vector<mot::Detection>> leaky_scene(int frames) {
  nn::Random random(5);
  std::vector<std::vector<mot::Detection>> scene;
  for (int frame = 1; frame <= frames; ++frame) {
    auto& seen = scene.emplace_back();
    for (const auto& detection :
         detect({walker(frame), {{900 - 3.0 * frame, 400, 40, 90}}, {{300, 600, 50, 110}}})) {
      if (random.uniform() < 0.7) seen.push_back(detection);
    }
  }
  return scene;
}

TEST(Tracker, TimesOfAConstantRateChangeNothing) {
  const auto scene = leaky_scene(300);
  TrackerOptions options;
  options.input.frame_rate = 25;
  Tracker counted, timed(options);
  std::vector<FinishedFrame> expected, got;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    for (const auto& done : counted.update(scene[i])) expected.push_back(done);
    const double time = 1e9 + static_cast<double>(i) / 25;
    for (const auto& done : timed.update(scene[i], {.time = time})) got.push_back(done);
  }
  for (const auto& done : counted.finish()) expected.push_back(done);
  for (const auto& done : timed.finish()) got.push_back(done);
  EXPECT_EQ(text(expected), text(got));
  EXPECT_EQ(got.size(), scene.size());
}

// Frames that a camera lost are frames that nobody looked at; these are reported, those are not.
TEST(Tracker, LostFramesAreLikeSkippedOnesButNotReported) {
  const auto scene = leaky_scene(300);
  TrackerOptions options;
  options.input.frame_rate = 25;
  Tracker skipping(options), losing(options);
  std::map<int, std::vector<TrackedBox>> expected, got;
  std::vector<int> kept{0};  // the frame of each call, from 1
  const auto keep_expected = [&](const auto& frames) {
    for (const auto& done : frames) expected[done.frame] = done.boxes;
  };
  const auto keep_got = [&](const auto& frames) {
    for (const auto& done : frames) got[kept[done.frame]] = done.boxes;
  };
  for (int frame = 1; frame <= 300; ++frame) {
    if (frame % 3 == 2) {
      keep_expected(skipping.skip());
      continue;
    }
    kept.push_back(frame);
    keep_expected(skipping.update(scene[frame - 1]));
    keep_got(losing.update(scene[frame - 1], {.time = frame / 25.0}));
  }
  keep_expected(skipping.finish());
  keep_got(losing.finish());
  EXPECT_EQ(expected.size(), 300u);
  EXPECT_EQ(got.size(), 200u);
  for (const auto& [frame, boxes] : got) {
    ASSERT_EQ(boxes.size(), expected[frame].size()) << frame;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      EXPECT_EQ(boxes[i].id, expected[frame][i].id) << frame;
      EXPECT_NEAR(boxes[i].box.left, expected[frame][i].box.left, 1e-6) << frame;
    }
  }
}

TEST(Tracker, NobodyMissesADetectionInFramesThatAreSkipped) {
  Tracker tracker;
  std::vector<FinishedFrame> all;
  for (int frame = 1; frame <= 200; ++frame) {
    const bool look = frame % 4 == 1;
    const auto& done = look ? tracker.update(detect({walker(frame)})) : tracker.skip();
    all.insert(all.end(), done.begin(), done.end());
  }
  for (const auto& done : tracker.finish()) all.push_back(done);
  ASSERT_EQ(all.size(), 200u);
  EXPECT_EQ(ids(all), std::set<int>{1});
  for (int frame = 1; frame <= 197; ++frame) {
    ASSERT_EQ(all[frame - 1].boxes.size(), 1u) << frame;
    EXPECT_NEAR(all[frame - 1].boxes[0].box.left, walker(frame).box.left, 2) << frame;
  }
  EXPECT_EQ(tracker.stats().tracklets, 1);
}

TEST(Tracker, AJumpOfTheClockEndsTracksAndTimeNeverRunsBackwards) {
  TrackerOptions options;
  options.input.frame_rate = 25;
  Tracker tracker(options);
  std::vector<FinishedFrame> all;
  const auto take = [&](double time) {
    for (const auto& done : tracker.update(detect({{{100, 200, 40, 90}}}), {.time = time})) {
      all.push_back(done);
    }
  };
  for (int i = 0; i < 50; ++i) take(i / 25.0);
  EXPECT_THROW(take(1.0), std::invalid_argument);
  EXPECT_THROW(take(std::nan("")), std::invalid_argument);
  for (int i = 0; i < 50; ++i) take(1e7 + i / 25.0);
  for (const auto& done : tracker.finish()) all.push_back(done);
  EXPECT_EQ(all.size(), 100u);
  EXPECT_EQ(ids(all).size(), 2u);
  EXPECT_EQ(all[49].boxes[0].id, 1);
  EXPECT_EQ(all[50].boxes[0].id, 2);
}

mot::Tlwh seen_by(const mot::Tlwh& box, const image::CameraMotion& camera) {
  const double x = box.left + box.width / 2 - 1, y = box.top + box.height / 2 - 1;
  const double width = camera.scale() * box.width, height = camera.scale() * box.height;
  return {camera.a * x - camera.b * y + camera.tx + 1 - width / 2,
          camera.b * x + camera.a * y + camera.ty + 1 - height / 2, width, height};
}

// The same people seen by a camera that shakes, pans and zooms are the same tracks, each box where
// it is in its own frame.
TEST(Tracker, ACameraThatMovesChangesNothingWhenItIsSaidHow) {
  const auto scene = leaky_scene(300);
  Tracker still, told, blind;
  std::vector<FinishedFrame> expected, got, lost;
  std::vector<image::CameraMotion> from_start{{}};  // by frame
  for (int frame = 1; frame <= 300; ++frame) {
    const double turn = 0.01 * std::sin(frame / 9.0), zoom = 1 + 0.1 * std::sin(frame / 30.0);
    const image::CameraMotion now{zoom * std::cos(turn), zoom * std::sin(turn),
                                  40 * std::sin(frame * 0.7), 3.0 * frame};
    from_start.push_back(now);
    auto moved = scene[frame - 1];
    for (auto& detection : moved) detection.box = seen_by(detection.box, now);
    for (const auto& done : still.update(scene[frame - 1])) expected.push_back(done);
    const auto step = from_start[frame - 1].inverse().then(now);
    for (const auto& done : told.update(moved, {.camera = step})) got.push_back(done);
    for (const auto& done : blind.update(moved)) lost.push_back(done);
  }
  for (const auto& done : still.finish()) expected.push_back(done);
  for (const auto& done : told.finish()) got.push_back(done);
  for (const auto& done : blind.finish()) lost.push_back(done);
  EXPECT_EQ(ids(expected).size(), 3u);
  EXPECT_GT(ids(lost).size(), 3u);
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    ASSERT_EQ(got[i].boxes.size(), expected[i].boxes.size()) << i;
    for (std::size_t k = 0; k < got[i].boxes.size(); ++k) {
      const auto wanted = seen_by(expected[i].boxes[k].box, from_start[i + 1]);
      EXPECT_EQ(got[i].boxes[k].id, expected[i].boxes[k].id);
      // Process noise goes by the height of the present picture: nearly the same.
      EXPECT_NEAR(got[i].boxes[k].box.left, wanted.left, 1.5) << i;
      EXPECT_NEAR(got[i].boxes[k].box.top, wanted.top, 1.5) << i;
      EXPECT_NEAR(got[i].boxes[k].box.height, wanted.height, 1.5) << i;
    }
  }
}

TEST(Tracker, RefusesCameraMotionThatCannotBe) {
  Tracker tracker;
  for (const image::CameraMotion& wrong :
       {image::CameraMotion{0, 0, 0, 0}, image::CameraMotion{1, 0, 1e7, 0},
        image::CameraMotion{1, 0, 0, std::nan("")}, image::CameraMotion{20, 0, 0, 0}}) {
    EXPECT_THROW(tracker.update({}, {.camera = wrong}), std::invalid_argument);
  }
  EXPECT_EQ(tracker.stats().frames, 0);
}

TEST(Tracker, FramesComeInOrderAfterTheDelay) {
  const Frames frames = crowd(200, 5, 22);
  for (const int delay : {0, 7, 1000}) {
    TrackerOptions options;
    options.output.delay = delay;
    Tracker tracker(options);
    int last = 0;
    for (int frame = 1; frame <= 200; ++frame) {
      for (const auto& done : tracker.update(detect(frames[static_cast<std::size_t>(frame) - 1]))) {
        EXPECT_EQ(done.frame, ++last);
      }
      EXPECT_EQ(last, std::max(0, frame - delay));
    }
    for (const auto& done : tracker.finish()) EXPECT_EQ(done.frame, ++last);
    EXPECT_EQ(last, 200);
  }
}

TEST(Tracker, OnlineOutputNeverLooksBack) {
  Frames frames;
  for (int frame = 1; frame <= 120; ++frame) {
    const bool seen = frame <= 20 || frame > 50;
    frames.push_back(seen ? std::vector{walker(frame)} : std::vector<Person>{});
  }
  TrackerOptions options;
  options.output.delay = 0;
  const auto finished = track(frames, options, nullptr);
  for (const auto& frame : finished) {
    const bool known = (frame.frame >= 6 && frame.frame <= 20) || frame.frame >= 56;
    EXPECT_EQ(frame.boxes.size(), known ? 1u : 0u) << frame.frame;
  }
  // The second part was reported under its own id first; then the merge says who it is.
  EXPECT_EQ(ids(finished), (std::set<int>{1, 2}));
  std::vector<IdMerge> merges;
  for (const auto& frame : finished) {
    for (const auto& merge : frame.merges) merges.push_back(merge);
    for (const auto& box : frame.boxes)
      EXPECT_EQ(box.id, frame.frame < 51 || !merges.empty() ? 1 : 2);
  }
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].from, 2);
  EXPECT_EQ(merges[0].to, 1);
}

TEST(Tracker, IdsAreUniqueInAFrameAndSorted) {
  Frames truth;
  const Frames frames = crowd(500, 20, 23, &truth);
  for (const int delay : {0, 10, OutputOptions::kAutoDelay}) {
    TrackerOptions options;
    options.output.delay = delay;
    options.appearance.tau_a = 0.6;
    FakeDescriptor appearance;
    for (const auto& frame : track(frames, options, &appearance, nullptr, &truth)) {
      for (std::size_t i = 1; i < frame.boxes.size(); ++i) {
        ASSERT_LT(frame.boxes[i - 1].id, frame.boxes[i].id) << frame.frame;
      }
    }
  }
}

TEST(Tracker, TwoTrackersDoNotKnowOfEachOther) {
  const Frames frames = crowd(100, 6, 24);
  const std::string alone = text(track(frames, {}, nullptr));
  Tracker a, b;
  std::vector<FinishedFrame> from_a, from_b;
  for (const auto& people : frames) {
    for (const auto& done : a.update(detect(people))) from_a.push_back(done);
    for (const auto& done : b.update(detect(people))) from_b.push_back(done);
  }
  for (const auto& done : a.finish()) from_a.push_back(done);
  for (const auto& done : b.finish()) from_b.push_back(done);
  EXPECT_EQ(text(from_a), alone);
  EXPECT_EQ(text(from_b), alone);
}

TEST(Tracker, SurvivesHostileBoxes) {
  nn::Random random(25);
  const double values[] = {0, 1, -1, 1e-9, 1e9, -1e9, 1e12, 100, 101, 99.5};
  const auto any = [&] { return values[random.below(10)]; };
  for (TrackerOptions options : {paper(), TrackerOptions::tuned()}) {
    options.boosting.enabled = true;
    options.input.strong_confidence = -1e300;
    options.confidence.min_mean_confidence = -1e300;
    FakeDescriptor appearance;
    Tracker tracker(options, &appearance);
    std::int64_t boxes = 0;
    const auto check = [&](const std::vector<FinishedFrame>& finished) {
      for (const auto& frame : finished) {
        for (const auto& box : frame.boxes) {
          ++boxes;
          ASSERT_TRUE(std::isfinite(box.box.left) && std::isfinite(box.box.top)) << frame.frame;
          ASSERT_TRUE(std::isfinite(box.box.width) && box.box.width > 0) << frame.frame;
          ASSERT_TRUE(std::isfinite(box.box.height) && box.box.height > 0) << frame.frame;
        }
      }
    };
    const image::ImageView images[] = {blank(), blank(1, 1), blank(1000, 1), image::ImageView{}};
    for (int frame = 0; frame < 2000; ++frame) {
      std::vector<mot::Detection> detections;
      for (std::uint64_t i = random.below(6); i > 0; --i) {
        detections.push_back(
            {{any(), any(), std::abs(any()) + 1e-6, std::abs(any()) + 1e-6}, any()});
      }
      // One that stays, so that tracks come about.
      detections.push_back({{5000, 5000, 1e9, 1e9}, 0.9});
      for (mot::Detection& detection : detections) {
        detection.box.width = std::min(detection.box.width, 1e12);
        detection.box.height = std::min(detection.box.height, 1e12);
      }
      check(tracker.update(detections, &images[random.below(4)]));
    }
    check(tracker.finish());
    EXPECT_GT(boxes, 1000);
  }
}

TEST(Tracker, RefusesImpossibleDetectionsAndGoesOn) {
  Tracker tracker;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const mot::Detection good{{100, 100, 40, 90}, 0.9};
  tracker.update(std::vector{good});
  const std::pair<mot::Detection, const char*> cases[] = {
      {{{nan, 0, 1, 1}, 1}, "detection 1: left is nan, expected -1e12..1e12"},
      {{{0, inf, 1, 1}, 1}, "detection 1: top is inf"},
      {{{0, 0, 0, 1}, 1}, "detection 1: width is 0, expected > 0"},
      {{{0, 0, 1, -4}, 1}, "detection 1: height is -4, expected > 0"},
      {{{0, 0, 1e13, 4}, 1}, "detection 1: width is"},
      {{{0, 0, 1, 4}, nan}, "detection 1: score is nan"},
  };
  for (const auto& [detection, message] : cases) {
    try {
      tracker.update(std::vector{good, detection});
      ADD_FAILURE() << message;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(message));
    }
  }
  for (int frame = 0; frame < 9; ++frame) tracker.update(std::vector{good});
  EXPECT_EQ(tracker.stats().frames, 10);
  const auto& finished = tracker.finish();
  ASSERT_EQ(finished.size(), 10u);
  EXPECT_EQ(finished[0].boxes.size(), 1u);
}

// Throws in some calls instead of answering.
class FailingDescriptor final : public image::CropDescriptor {
 public:
  explicit FailingDescriptor(FakeDescriptor& inner) : inner_(inner) {}
  int dimension() const override { return inner_.dimension(); }
  std::string name() const override { return inner_.name(); }
  std::optional<double> tau_a() const override { return inner_.tau_a(); }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override {
    if (calls_left-- == 0) throw std::runtime_error("the appearance model failed");
    inner_.describe(crops, out);
  }

  int calls_left = -1;  // below 0: never fails

 private:
  FakeDescriptor& inner_;
};

TEST(Tracker, IsAsBeforeWhenTheDescriptorThrows) {
  Frames truth;
  const Frames frames = crowd(400, 10, 26, &truth);
  for (TrackerOptions options : {paper(), TrackerOptions::tuned()}) {
    options.appearance.tau_a = 0.6;
    options.boosting.enabled = true;
    TrackerStats expected_stats;
    FakeDescriptor fake;
    const auto expected = track(frames, options, &fake, &expected_stats, &truth);

    FailingDescriptor failing(fake);
    Tracker tracker(options, &failing);
    const image::ImageView image = blank();
    std::vector<FinishedFrame> all;
    nn::Random random(27);
    int failures = 0;
    // The frame with a failure in the given call of the model: the first embeds detections, the
    // next ones the samples of boosting. False when there was one.
    const auto attempt = [&](std::size_t i, int failing_call) {
      failing.calls_left = failing_call;
      const TrackerStats before = tracker.stats();
      try {
        for (const auto& done : tracker.update(detect(frames[i]), &image)) all.push_back(done);
        return true;
      } catch (const std::runtime_error&) {
        ++failures;
        EXPECT_EQ(tracker.stats().frames, before.frames);
        EXPECT_EQ(tracker.stats().detections, before.detections);
        EXPECT_EQ(tracker.stats().embedded, before.embedded);
        return false;
      }
    };
    for (std::size_t i = 0; i < frames.size(); ++i) {
      fake.people = truth[i];
      bool done = false;
      for (const int call : {0, 1}) {
        if (!done && random.below(2) == 0) done = attempt(i, call);
      }
      if (!done) attempt(i, -1);
    }
    for (const auto& done : tracker.finish()) all.push_back(done);
    EXPECT_GT(failures, 150);
    EXPECT_EQ(text(all), text(expected));
    EXPECT_EQ(tracker.stats().boosted, expected_stats.boosted);
    EXPECT_EQ(tracker.stats().embedded, expected_stats.embedded);
    EXPECT_EQ(tracker.stats().tracks, expected_stats.tracks);
  }
}

TEST(Tracker, EveryReportedTrackEndsOnceWithItsAppearance) {
  Frames truth;
  const Frames frames = crowd(700, 8, 28, &truth);
  TrackerOptions options;
  options.appearance.tau_a = 0.6;
  options.output.delay = 0;  // so that ids that are merged later are reported
  FakeDescriptor appearance;
  Tracker tracker(options, &appearance);
  std::set<int> reported, ended, merged;
  std::map<int, int> last_seen;
  std::size_t with_appearance = 0;
  tracker.on_track_ended([&](const EndedTrack& track) {
    EXPECT_TRUE(ended.insert(track.id).second) << track.id;
    if (!track.gallery.empty()) ++with_appearance;  // others never came into the picture
    EXPECT_LT(track.first_frame, track.last_frame);
    EXPECT_GE(track.last_frame, last_seen[track.id]);
  });
  const auto take = [&](const std::vector<FinishedFrame>& finished) {
    for (const auto& frame : finished) {
      for (const auto& merge : frame.merges) merged.insert(merge.from);
      for (const auto& box : frame.boxes) {
        reported.insert(box.id);
        EXPECT_FALSE(ended.contains(box.id)) << box.id << " comes again";
        ASSERT_NE(tracker.gallery(box.id), nullptr);
        if (box.source == BoxSource::detected) last_seen[box.id] = frame.frame;
      }
    }
  };
  const image::ImageView image = blank();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    appearance.people = truth[i];
    take(tracker.update(detect(frames[i]), &image));
  }
  EXPECT_FALSE(ended.empty());
  EXPECT_EQ(tracker.gallery(*ended.begin()), nullptr);
  tracker.finish();
  EXPECT_FALSE(merged.empty());
  for (const int id : reported) EXPECT_NE(ended.contains(id), merged.contains(id)) << id;
  EXPECT_EQ(ended.size() + merged.size(), reported.size());
  EXPECT_GT(with_appearance, ended.size() / 2);
}

TEST(Tracker, NothingFollowsTheEnd) {
  Tracker tracker;
  tracker.update(std::vector<mot::Detection>{});
  tracker.finish();
  EXPECT_THROW(tracker.update(std::vector<mot::Detection>{}), std::logic_error);
  EXPECT_THROW(tracker.finish(), std::logic_error);
  EXPECT_EQ(tracker.stats().frames, 1);
}

TEST(Tracker, FramesWithoutImageAreTrackedByMotion) {
  FakeDescriptor appearance;
  TrackerOptions options;
  Tracker tracker(options, &appearance);
  const image::ImageView image = blank();
  for (int frame = 1; frame <= 40; ++frame) {
    appearance.people = {walker(frame)};
    const bool readable = frame < 15 || frame > 18;
    tracker.update(detect({walker(frame)}), readable ? &image : nullptr);
  }
  tracker.finish();
  EXPECT_EQ(tracker.stats().tracks, 1);
  EXPECT_EQ(tracker.stats().embedded, 36);
}

TEST(Tracker, InvalidCropsAreCountedAndMatchedByMotion) {
  FakeDescriptor appearance;
  Tracker tracker(paper(), &appearance);
  const image::ImageView image = blank(200, 200);
  for (int frame = 1; frame <= 20; ++frame) {
    appearance.people = {{{-100, 100, 40, 90}, 0}};  // left of the image
    tracker.update(detect(appearance.people), &image);
  }
  const auto& finished = tracker.finish();
  EXPECT_EQ(tracker.stats().without_embedding, 20);
  EXPECT_EQ(ids(finished).size(), 1u);
}

TEST(Tracker, NoFramesAndNoDetectionsAreFine) {
  Tracker nothing;
  EXPECT_TRUE(nothing.finish().empty());
  Tracker empty;
  for (int frame = 0; frame < 300; ++frame) empty.update({});
  EXPECT_FALSE(empty.finish().empty());
  EXPECT_EQ(empty.stats().frames, 300);
}

TEST(Tracker, NeedsAThresholdOfTheOptionsOrTheDescriptor) {
  FakeDescriptor descriptor;
  descriptor.threshold.reset();
  try {
    Tracker tracker({}, &descriptor);
    ADD_FAILURE() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(),
                 "the descriptor 'fake' has no tau_a, expected AppearanceOptions::tau_a");
  }
  TrackerOptions options;
  options.appearance.tau_a = 0.6;
  EXPECT_NO_THROW(Tracker(options, &descriptor));
}

}  // namespace
}  // namespace sdmt::track
