// SPDX-License-Identifier: Apache-2.0
// update_time BOXES: microseconds of processor time that Tracker::update() takes a frame of a file
// of boxes, by motion alone. What bench/python_overhead.py compares the Python module with.
#include <cstdio>
#include <ctime>

#include "sdmt/mot/mot_file.h"
#include "sdmt/track/tracker.h"

int main(int argc, char** argv) {
  using namespace sdmt;
  if (argc != 2) return 2;
  const auto boxes = mot::DetectionFile::read(argv[1]);
  track::Tracker tracker;
  std::size_t people = 0;
  const auto count = [&](const auto& frames) {
    for (const track::FinishedFrame& frame : frames) people += frame.boxes.size();
  };
  const std::clock_t start = std::clock();
  for (int frame = 1; frame <= boxes.last_frame(); ++frame) {
    count(tracker.update(boxes.frame(frame)));
  }
  count(tracker.finish());
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::printf("%.3f %zu\n", 1e6 * seconds / boxes.last_frame(), people);
}
