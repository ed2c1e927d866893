// SPDX-License-Identifier: Apache-2.0
// Time of Tracker::update by motion alone, by people in view: a square that grows with them, so
// that the crowd is as dense as with 15 people in a picture of 1920 x 1080. The counter divides by
// n log2 n: it must not rise. And of finding how the camera moved, in a picture of that size.
//   bench_track
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "sdmt/image/camera_motion.h"
#include "sdmt/image/image.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/tracker.h"

namespace sdmt::track {
namespace {

constexpr int kFrames = 600;

struct Walker {
  double x, y, vx, vy, height;
  int leaves;
  int hidden = 0;  // frames
};

// Walkers with a jitter of 2 pixels, misses, weak boxes, occlusions of up to 40 frames, and false
// boxes.
std::vector<std::vector<mot::Detection>> crowd(int people) {
  nn::Random random(5);
  const double scale = std::sqrt(people / 15.0);
  const auto place = [&] { return random.uniform(0, 1920 * scale); };
  std::vector<Walker> walkers;
  std::vector<std::vector<mot::Detection>> frames(kFrames);
  for (int frame = 0; frame < kFrames; ++frame) {
    auto& detections = frames[static_cast<std::size_t>(frame)];
    while (static_cast<int>(walkers.size()) < people) {
      walkers.push_back({place(), random.uniform(0, 900 * scale), random.uniform(-3, 3),
                         random.uniform(-0.6, 0.6), random.uniform(60, 200),
                         frame + 60 + static_cast<int>(random.below(500))});
    }
    for (Walker& walker : walkers) {
      walker.x += walker.vx;
      walker.y += walker.vy;
      if (walker.hidden > 0) {
        --walker.hidden;
        continue;
      }
      if (random.uniform() < 0.01) walker.hidden = static_cast<int>(random.below(40));
      if (random.uniform() < 0.07) continue;
      detections.push_back({{walker.x + 2 * random.normal(), walker.y + 2 * random.normal(),
                             0.4 * walker.height, walker.height},
                            random.uniform() < 0.1 ? 0.4 : 0.9});
    }
    for (int i = 0; i <= people / 15; ++i) {
      detections.push_back(
          {{place(), random.uniform(0, 900 * scale), 40, 100}, random.uniform(0.2, 1)});
    }
    std::erase_if(walkers, [frame](const Walker& walker) { return walker.leaves <= frame; });
  }
  return frames;
}

void update(benchmark::State& state) {
  const auto frames = crowd(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    Tracker tracker;
    for (const auto& detections : frames) benchmark::DoNotOptimize(tracker.update(detections));
  }
  const double people = static_cast<double>(state.range(0));
  const double updates = static_cast<double>(state.iterations()) * kFrames;
  state.counters["frames/s"] = benchmark::Counter(updates, benchmark::Counter::kIsRate);
  state.counters["s/(n log2 n)"] =
      benchmark::Counter(updates * people * std::log2(people),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(update)->Arg(8)->Arg(15)->Arg(31)->Arg(62)->Arg(125)->Arg(250)->Arg(500)->Unit(
    benchmark::kMillisecond);

// A street of waves, seen from a camera that was shifted.
image::Image street(int shift) {
  image::Image picture(1920, 1080);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double at = x + shift;
      const double grey = 120 + 40 * std::sin(at / 31) + 30 * std::cos(y / 23.0) +
                          30 * std::sin((at + 2 * y) / 97) +
                          20 * std::sin(at / 9) * std::sin(y / 7.0);
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = static_cast<std::uint8_t>(grey);
    }
  }
  return picture;
}

// `range`: pixels that it moves from each frame to the next, to and fro.
void camera_motion(benchmark::State& state) {
  const image::Image here = street(0), there = street(static_cast<int>(state.range(0)));
  const std::vector<image::PixelRect> people(20, {600, 400, 80, 200});
  image::CameraMotionEstimator estimator;
  bool found = true;
  for (auto _ : state) {
    found = found && estimator.next(here.view(), people) && estimator.next(there.view(), people);
  }
  if (!found) state.SkipWithError("the motion was not found");
  state.counters["s/frame"] =
      benchmark::Counter(2.0 * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(camera_motion)->Arg(0)->Arg(10)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sdmt::track

BENCHMARK_MAIN();
