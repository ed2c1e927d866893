// SPDX-License-Identifier: Apache-2.0
// Runs the tracker for very long and fails when its memory or its time a frame grow:
//   soak_tracker FRAMES
// Thirty people walk about; each stays for some hundred frames, is now and then hidden, and is
// followed by somebody new, so that tracks are born, rest, join and end all the time.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "sdmt/nn/random.h"
#include "sdmt/track/tracker.h"

namespace {

using namespace sdmt;

constexpr int kPeople = 30;

struct Person {
  int number = 0;
  double x = 0, y = 0, vx = 0, vy = 0;
  int frames_left = 0;
  int hidden_for = 0;
};

// Vectors that belong to the people: the box's width carries the person's number.
class KnownAppearance : public track::AppearanceModel {
 public:
  int dimension() const override { return 16; }
  double affinity_threshold() const override { return 0.5; }
  void embed(const nn::ImageView&, std::span<const track::Tlwh> boxes,
             track::Embeddings& out) override {
    out.dimension = dimension();
    out.values.clear();
    out.valid.assign(boxes.size(), 1);
    for (const track::Tlwh& box : boxes) {
      nn::Random random(static_cast<std::uint64_t>(std::llround(box.width * 1e6)));
      std::vector<float> vector(static_cast<std::size_t>(dimension()));
      double length = 0;
      for (float& value : vector) {
        value = static_cast<float>(random.normal());
        length += double{value} * value;
      }
      for (const float value : vector) {
        out.values.push_back(static_cast<float>(value / std::sqrt(length)));
      }
    }
  }
};

double peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Person new_person(int number, nn::Random& random) {
  Person person;
  person.number = number;
  person.x = random.uniform(0, 1900);
  person.y = random.uniform(200, 900);
  person.vx = random.uniform(-3, 3);
  person.vy = random.uniform(-1, 1);
  person.frames_left = static_cast<int>(random.uniform(60, 500));
  return person;
}

}  // namespace

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 20000;
  if (frames < 1000) {
    std::fprintf(stderr, "usage: soak_tracker FRAMES, at least 1000\n");
    return 2;
  }
  nn::Random random(1);
  int numbers = 0;
  std::vector<Person> people;
  for (int i = 0; i < kPeople; ++i) people.push_back(new_person(++numbers, random));

  KnownAppearance appearance;
  track::Tracker tracker({}, &appearance);
  const std::vector<std::uint8_t> pixels(3 * 16 * 16);
  const nn::ImageView image{pixels.data(), 16, 16, 48, nn::ChannelOrder::bgr};
  const int part = frames / 10;
  double early_mib = 0;
  std::vector<double> part_seconds;
  std::size_t boxes = 0;
  auto start = std::chrono::steady_clock::now();
  for (int frame = 1; frame <= frames; ++frame) {
    std::vector<track::Detection> detections;
    for (Person& person : people) {
      if (--person.frames_left < 0) person = new_person(++numbers, random);
      person.x += person.vx;
      person.y += person.vy;
      if (person.hidden_for-- > 0) continue;
      if (random.uniform() < 0.01) person.hidden_for = static_cast<int>(random.uniform(1, 60));
      const double width = 40 + 1e-5 * person.number;
      detections.push_back({{person.x + random.normal(), person.y + random.normal(), width, 100},
                            random.uniform(0.5, 1)});
    }
    for (const auto& finished : tracker.update(detections, &image)) boxes += finished.boxes.size();
    if (frame % part == 0) {
      const auto now = std::chrono::steady_clock::now();
      part_seconds.push_back(std::chrono::duration<double>(now - start).count());
      start = now;
      if (frame == part) early_mib = peak_mib();
      std::printf("frame %7d  peak %6.1f MiB  %7.0f frames/s\n", frame, peak_mib(),
                  part / part_seconds.back());
    }
  }
  tracker.finish();
  const auto& stats = tracker.stats();
  std::printf("%zu boxes, %lld tracks, %lld merges, %d people\n", boxes,
              static_cast<long long>(stats.tracks), static_cast<long long>(stats.merges), numbers);
  // The median of the later parts: a busy machine disturbs single ones.
  std::vector<double> late(part_seconds.begin() + 5, part_seconds.end());
  std::nth_element(late.begin(), late.begin() + 2, late.end());
  const bool flat_memory = peak_mib() <= std::max(1.05 * early_mib, early_mib + 1);
  const bool flat_time = late[2] <= 2 * part_seconds[1];
  std::printf("memory %s, time %s\n", flat_memory ? "flat" : "GROWS", flat_time ? "flat" : "GROWS");
  return flat_memory && flat_time && boxes > 0 && stats.merges > 0 ? 0 : 1;
}
