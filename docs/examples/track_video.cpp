// SPDX-License-Identifier: Apache-2.0
// Tracking whatever `sdmt track` takes, in a program of one's own: needs the component pipeline.
//
//   find_package(sdmt REQUIRED COMPONENTS pipeline)
//   target_link_libraries(track_video PRIVATE sdmt::pipeline)
//
//   track_video INPUT TRACKS.txt: by motion alone; INPUT is a video, a camera, a folder, a URL.
#include <sdmt/pipeline/detection_source.h>
#include <sdmt/pipeline/frame_source.h>
#include <sdmt/pipeline/sequence_runner.h>
#include <sdmt/pipeline/track_writers.h>
#include <sdmt/track/tracker.h>

#include <cstdio>
#include <exception>
#include <string>

using namespace sdmt;

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::puts("usage: track_video INPUT TRACKS.txt");
    return 2;
  }
  const std::string input = argv[1];
  const auto frames = pipeline::open_frame_source(input);
  const auto boxes = pipeline::open_detection_source(pipeline::default_detections(input));
  const auto tracks = pipeline::make_mot_writer(argv[2]);

  track::TrackerOptions options;
  pipeline::fit_to_scores(options, *boxes);
  track::Tracker tracker(options);
  pipeline::RunObservers observers;
  observers.finished = [&](const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
    tracks->write(frame, time);
  };
  observers.warning = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  const auto report = pipeline::run_sequence(*frames, *boxes, tracker, false, observers);
  tracks->commit();
  std::printf("%lld frames\n", static_cast<long long>(report.stats.frames));
} catch (const std::exception& error) {
  std::fprintf(stderr, "track_video: %s\n", error.what());
  return 1;
}
