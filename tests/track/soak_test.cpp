// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "scene.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/tracker.h"

// Thirty walkers with constant births, for ever. SDMT_SOAK_FRAMES=200000 makes it long.

namespace sdmt::track {
namespace {

// GCC has macros for its sanitizers, clang features.
#if !defined(__has_feature)
#define __has_feature(x) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kMeasurable = false;
#else
constexpr bool kMeasurable = true;
#endif

std::size_t live_bytes() { return mallinfo2().uordblks; }

class Street {
 public:
  std::vector<test::Person> step() {
    while (walkers_.size() < 30) {
      const bool right = random_.uniform() < 0.5;
      walkers_.push_back({right ? -40.0 : 1920.0, random_.uniform(0, 900),
                          (right ? 1 : -1) * random_.uniform(2, 8),
                          static_cast<int>(random_.below(15)), random_.uniform(0, 1) < 0.5});
    }
    people.clear();
    for (Walker& walker : walkers_) {
      walker.left += walker.speed;
      // Half of them walk behind a pillar of 100 pixels.
      if (walker.hides && walker.left > 900 && walker.left < 1000) continue;
      if (random_.uniform() < 0.05) continue;
      people.push_back({{walker.left, walker.top + random_.normal(), 40, 100}, walker.look});
    }
    std::erase_if(walkers_,
                  [](const Walker& walker) { return walker.left < -60 || walker.left > 1940; });
    return people;
  }

 private:
  struct Walker {
    double left, top, speed;
    int look;
    bool hides;
  };
  nn::Random random_{31};
  std::vector<Walker> walkers_;
  std::vector<test::Person> people;
};

TEST(Soak, MemoryAndTimeStayFlat) {
  const char* wanted = std::getenv("SDMT_SOAK_FRAMES");
  const int frames = wanted != nullptr ? std::max(20000, std::atoi(wanted)) : 20000;
  const int tenth = frames / 10;
  test::FakeDescriptor appearance;
  Tracker tracker({}, &appearance);
  Street street;
  const image::ImageView image = test::blank(1920, 1080);
  std::vector<std::size_t> memory(10, 0);
  std::vector<double> seconds(10, 0);
  std::int64_t boxes = 0;
  for (int frame = 0; frame < frames; ++frame) {
    appearance.people = street.step();
    const auto detections = test::detect(appearance.people);
    const std::clock_t start = std::clock();
    for (const auto& done : tracker.update(detections, &image)) {
      boxes += static_cast<std::int64_t>(done.boxes.size());
    }
    const auto part = static_cast<std::size_t>(frame / tenth);
    seconds[part] += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (frame % 100 == 99) memory[part] = std::max(memory[part], live_bytes());
  }
  EXPECT_GT(boxes, 20 * static_cast<std::int64_t>(frames));
  EXPECT_GT(tracker.stats().tracks, frames / 30);
  EXPECT_GT(tracker.stats().merges, frames / 1000);
  if (!kMeasurable) GTEST_SKIP() << "memory and time are not those of the tracker";
  for (std::size_t part = 0; part < 10; ++part) {
    std::printf("frames to %7d: %6.2f MiB at most, %5.1f us a frame\n",
                static_cast<int>(part + 1) * tenth, static_cast<double>(memory[part]) / (1 << 20),
                1e6 * seconds[part] / tenth);
  }
  const std::size_t early = *std::max_element(memory.begin() + 1, memory.begin() + 5);
  const std::size_t late = *std::max_element(memory.begin() + 5, memory.end());
  EXPECT_LT(static_cast<double>(late), 1.05 * static_cast<double>(early));
}

}  // namespace
}  // namespace sdmt::track
