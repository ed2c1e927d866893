// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/frame_replay.h"
#include "sdmt/pipeline/track_renderer.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/video_output_file.h"

namespace sdmt::pipeline {

namespace {

constexpr double kUnknownFrameRate = 25;

class TracksVideo : public TrackWriter {
 public:
  TracksVideo(const std::string& path, const std::string& input, const FrameSource& source,
              UnreadableFrames& unreadable)
      : file_(path, source.frame_rate() > 0 ? source.frame_rate() : kUnknownFrameRate),
        replay_(input, source),
        unreadable_(unreadable) {}

  bool needs_images() const override { return replay_.keeps_images(); }
  void read(const Frame& frame) override { replay_.add(frame); }
  void write(const track::FinishedFrame& finished) override {
    Frame frame = replay_.next();
    unreadable_.add(frame, "it is drawn grey");
    renderer_.draw(finished, frame.image);
    file_.write(frame.image);
  }
  void commit() override { file_.commit(); }

 private:
  VideoOutputFile file_;
  FrameReplay replay_;
  TrackRenderer renderer_;
  UnreadableFrames& unreadable_;
};

}  // namespace

std::unique_ptr<TrackWriter> make_video_writer(const std::string& path, const std::string& input,
                                               const FrameSource& source,
                                               UnreadableFrames& unreadable) {
  return std::make_unique<TracksVideo>(path, input, source, unreadable);
}

}  // namespace sdmt::pipeline
