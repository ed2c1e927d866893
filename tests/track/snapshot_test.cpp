// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "scene.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/result_rows.h"
#include "sdmt/track/tracker.h"

namespace sdmt::track {
namespace {

using test::blank;
using test::detect;
using test::FakeDescriptor;
using test::Person;

constexpr int kFrames = 400;

// People who walk across each other, are hidden for a while and come back, and false boxes.
class Street {
 public:
  Street() {
    nn::Random random(3);
    for (int frame = 1; frame <= kFrames; ++frame) {
      auto& people = people_.emplace_back();
      auto& seen = seen_.emplace_back();
      for (int i = 0; i < 8; ++i) {
        const double speed = i % 2 == 0 ? 2.5 : -2.0;
        const double left = 300 + 100 * i + speed * (frame - 200) / 2;
        const double bob = random.uniform() * 2;
        people.push_back({{left, 200 + 12.0 * i + bob, 40, 90}, i});
        if ((frame + 40 * i) % 130 < 25 || random.uniform() < 0.1) continue;
        seen.push_back({people.back().box, 0.35 + 0.6 * random.uniform()});
      }
      if (random.uniform() < 0.3) {
        seen.push_back({{1500 * random.uniform(), 500, 40, 90}, random.uniform()});
      }
    }
  }

  // Frames `first`..`last`: what comes out of them, appended to `rows`.
  void run(Tracker& tracker, FakeDescriptor* appearance, int first, int last,
           std::vector<mot::ResultRow>& rows) const {
    const image::ImageView image = blank();
    for (int frame = first; frame <= last; ++frame) {
      if (appearance != nullptr) appearance->people = people_[frame - 1];
      FrameContext context{.image = &image, .time = frame * 0.04 + (frame > 200 ? 0.3 : 0)};
      if (frame % 5 == 0) context.camera = {1 + 1e-3 * (frame % 3 - 1), 1e-4, 0.5, -0.3};
      const auto& done =
          frame % 7 == 3 ? tracker.skip(context) : tracker.update(seen_[frame - 1], context);
      for (const auto& finished : done) append_results(finished, rows);
    }
    if (last < kFrames) return;
    for (const auto& finished : tracker.finish()) append_results(finished, rows);
  }

 private:
  std::vector<std::vector<Person>> people_;
  std::vector<std::vector<mot::Detection>> seen_;
};

std::string text(const std::vector<mot::ResultRow>& rows) {
  std::string all;
  for (const auto& row : rows) all += mot::format_result(row);
  return all;
}

std::vector<TrackerOptions> variants() {
  TrackerOptions timed, needed, boosting;
  timed.input.frame_rate = 25;
  needed.appearance.embed = EmbedPolicy::needed;
  timed.scene.learning = SceneLearning::on;
  timed.output.amodal = {900, 340};
  boosting.boosting.enabled = true;
  TrackerOptions held = TrackerOptions::paper();
  held.output.delay = 200;
  return {timed, needed, boosting, held, TrackerOptions::online()};
}

TEST(Snapshot, GoesOnWithTheSameBytesFromAnyFrame) {
  const Street street;
  nn::Random random(9);
  for (const bool by_appearance : {false, true}) {
    for (const TrackerOptions& options : variants()) {
      FakeDescriptor looks;
      FakeDescriptor* const model = by_appearance ? &looks : nullptr;
      Tracker whole(options, model);
      std::vector<mot::ResultRow> expected;
      street.run(whole, model, 1, kFrames, expected);
      ASSERT_GT(whole.stats().tracks, 5);
      for (int kill = 0; kill < 5; ++kill) {
        const int last = 1 + static_cast<int>(random.uniform() * (kFrames - 2));
        std::vector<mot::ResultRow> rows;
        std::vector<std::byte> snapshot;
        {
          Tracker killed(options, model);
          street.run(killed, model, 1, last, rows);
          snapshot = killed.save();
          std::vector<mot::ResultRow> lost;
          street.run(killed, model, last + 1, std::min(last + 5, kFrames - 1), lost);
        }
        FakeDescriptor elsewhere;
        Tracker restored(options, by_appearance ? &elsewhere : nullptr);
        restored.restore(snapshot);
        EXPECT_EQ(restored.save(), snapshot) << last;
        street.run(restored, by_appearance ? &elsewhere : nullptr, last + 1, kFrames, rows);
        ASSERT_EQ(text(rows), text(expected)) << "killed after frame " << last;
        EXPECT_EQ(restored.stats().merges, whole.stats().merges);
        EXPECT_EQ(restored.stats().tracks, whole.stats().tracks);
        EXPECT_EQ(restored.stats().frames, kFrames);
      }
    }
  }
}

std::string problem(Tracker& tracker, std::span<const std::byte> snapshot) {
  try {
    tracker.restore(snapshot);
  } catch (const std::invalid_argument& failure) {
    return failure.what();
  }
  return "no error";
}

TEST(Snapshot, RefusesOtherTrackersAndDamage) {
  const Street street;
  FakeDescriptor looks;
  Tracker tracker({}, &looks);
  std::vector<mot::ResultRow> rows;
  street.run(tracker, &looks, 1, 100, rows);
  auto snapshot = tracker.save();

  TrackerOptions options;
  options.motion.max_misses = 7;
  Tracker other(options, &looks);
  EXPECT_EQ(problem(other, snapshot), "snapshot: is of a tracker with another --max-misses");
  Tracker blind;
  EXPECT_EQ(problem(blind, snapshot), "snapshot: is of a tracker with another appearance model");
  FakeDescriptor strict;
  strict.threshold = 0.7;
  Tracker stricter({}, &strict);
  EXPECT_EQ(problem(stricter, snapshot), "snapshot: is of a tracker with another tau_a");

  Tracker same({}, &looks);
  EXPECT_EQ(problem(same, std::span(snapshot).first(10)), "snapshot: ends too early");
  EXPECT_EQ(problem(same, std::span(snapshot).first(snapshot.size() - 1)), "snapshot: is damaged");
  snapshot[snapshot.size() / 2] ^= std::byte{1};
  EXPECT_EQ(problem(same, snapshot), "snapshot: is damaged");
  snapshot[4] = std::byte{99};
  EXPECT_EQ(problem(same, snapshot), "snapshot: is of another version of the program");
  snapshot[0] = std::byte{0};
  EXPECT_EQ(problem(same, snapshot), "snapshot: is none of a tracker");
  EXPECT_EQ(same.stats().frames, 0);

  tracker.finish();
  EXPECT_THROW(tracker.save(), std::logic_error);
}

// The checksum as the format has it, so that damage reaches what stands behind it.
void sign(std::vector<std::byte>& snapshot) {
  constexpr std::size_t kHead = 16, kSum = 8;
  std::uint64_t sum = 0xcbf29ce484222325;
  for (std::size_t i = kHead; i < snapshot.size(); i += kSum) {
    std::uint64_t word = 0;
    std::memcpy(&word, snapshot.data() + i, std::min(kSum, snapshot.size() - i));
    sum = (sum ^ word) * 0x100000001b3;
  }
  std::memcpy(snapshot.data() + kHead - kSum, &sum, kSum);
}

TEST(Snapshot, AnyBytesAreRefusedOrHarmless) {
  const Street street;
  nn::Random random(11);
  FakeDescriptor looks;
  Tracker tracker({}, &looks);
  std::vector<mot::ResultRow> rows;
  street.run(tracker, &looks, 1, 150, rows);
  const auto snapshot = tracker.save();
  int refused = 0;
  constexpr int kTrials = 120;
  for (int trial = 0; trial < kTrials; ++trial) {
    auto damaged = snapshot;
    // Behind the options, which refuse any change.
    const auto at = [&](std::size_t from) {
      return from + static_cast<std::size_t>(random.uniform() *
                                             static_cast<double>(damaged.size() - from - 9));
    };
    if (trial % 10 == 0) damaged.resize(at(2000));
    for (int change = 0; change < 1 + trial % 3; ++change) {
      const std::size_t place = at(std::min<std::size_t>(1500, damaged.size() / 2));
      if (trial % 2 == 0) {
        damaged[place] = static_cast<std::byte>(random.uniform() * 256);
      } else {
        const std::uint64_t odd[] = {0, ~0ULL, 1ULL << 63, 0x7ff0000000000000, 0x7fefffffffffffff,
                                     1};
        std::memcpy(damaged.data() + place, &odd[trial / 2 % 6], 8);
      }
    }
    sign(damaged);
    FakeDescriptor elsewhere;
    Tracker victim({}, &elsewhere);
    try {
      victim.restore(damaged);
    } catch (const std::invalid_argument&) {
      ++refused;
      continue;
    }
    street.run(victim, &elsewhere, 151, kFrames, rows);
  }
  EXPECT_GT(refused, kTrials / 10);
  EXPECT_LT(refused, kTrials);
}

}  // namespace
}  // namespace sdmt::track
