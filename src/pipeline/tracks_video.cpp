// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <utility>

#include "sdmt/pipeline/frame_replay.h"
#include "sdmt/pipeline/people_blur.h"
#include "sdmt/pipeline/track_renderer.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/video_output_file.h"
#include "video_segments.h"

namespace sdmt::pipeline {

namespace {

constexpr double kUnknownFrameRate = 25;

std::unique_ptr<VideoOutput> open_video(const std::string& path, double frame_rate,
                                        const std::optional<Flowing>& flowing) {
  if (flowing) return std::make_unique<VideoSegments>(path, frame_rate, *flowing);
  return std::make_unique<VideoOutputFile>(path, frame_rate);
}

class TracksVideo : public TrackWriter {
 public:
  TracksVideo(const std::string& path, const std::string& input, const FrameSource& source,
              UnreadableFrames& unreadable, const std::optional<Flowing>& flowing, bool blur)
      : blur_(blur),
        frame_rate_(source.frame_rate() > 0 ? source.frame_rate() : kUnknownFrameRate),
        file_(open_video(path, frame_rate_, flowing)),
        replay_(input, source),
        unreadable_(unreadable) {}

  bool needs_images() const override { return replay_.keeps_images(); }
  void read(const Frame& frame) override { replay_.add(frame); }
  void write(const track::FinishedFrame& finished, const FrameTime& time) override {
    Frame frame = replay_.next();
    unreadable_.add(frame, "it is drawn grey");
    if (blur_) blur_people(finished, frame.image);
    renderer_.draw(finished, frame.image);
    show_until(time.time);
    shown_ = std::move(frame.image);
  }
  void commit() override {
    if (!shown_.bgr.empty()) file_->write(shown_);
    file_->commit();
  }

 private:
  // Repeats the frame before as long as it lasted. Not at all where two fall
  // into one picture of the video.
  void show_until(std::optional<double> time) {
    if (shown_.bgr.empty()) return;
    std::int64_t due = pictures_ + 1;
    if (time) {
      due = std::llround((*time - cut_) * frame_rate_);
      const auto longest = std::llround(kLongestStill * frame_rate_);
      if (due - pictures_ > longest) {
        cut_ += static_cast<double>(due - pictures_ - longest) / frame_rate_;
        due = pictures_ + longest;
      }
    }
    for (; pictures_ < due; ++pictures_) file_->write(shown_);
  }

  bool blur_;
  double frame_rate_;
  std::unique_ptr<VideoOutput> file_;
  FrameReplay replay_;
  TrackRenderer renderer_;
  UnreadableFrames& unreadable_;
  image::Image shown_;         // drawn, and not written yet
  std::int64_t pictures_ = 0;  // written
  double cut_ = 0;             // seconds of long gaps that are not shown
};

}  // namespace

std::unique_ptr<TrackWriter> make_video_writer(const std::string& path, const std::string& input,
                                               const FrameSource& source,
                                               UnreadableFrames& unreadable,
                                               const std::optional<Flowing>& flowing, bool blur) {
  return std::make_unique<TracksVideo>(path, input, source, unreadable, flowing, blur);
}

}  // namespace sdmt::pipeline
