// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/sequence_runner.h"

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <stdexcept>
#include <vector>

#include "ahead.h"
#include "sdmt/io/stopwatch.h"
#include "sdmt/track/pixel_rect.h"

namespace sdmt::pipeline {

namespace {

// The times of the frames that are not finished.
class FrameTimes {
 public:
  void add(int frame, const FrameTime& time) {
    if (times_.empty()) first_ = frame;
    times_.push_back(time);
  }
  // That of a frame, in order; nothing is known of frames that were there before a run was killed.
  FrameTime take(int frame) {
    if (times_.empty() || frame < first_) return {};
    const FrameTime time = times_.front();
    times_.pop_front();
    ++first_;
    return time;
  }
  // Seconds that rise also from one run to the next where a camera gives them.
  std::optional<double> on_one_clock(const FrameTime& when) {
    if (when.time && when.wall_clock && began_ == 0) {
      const std::chrono::duration<double> since_1970 = when.wall_clock->time_since_epoch();
      began_ = since_1970.count() - *when.time;
    }
    return when.time ? std::optional(*when.time + began_) : std::nullopt;
  }

 private:
  std::deque<FrameTime> times_;
  int first_ = 0;  // number of the first of them
  double began_ = 0;
};

// A frame, and what a detector found in it.
struct Look {
  Frame frame;
  std::vector<mot::Detection> boxes;
  bool looked = true;
  std::exception_ptr failure;
};

double rate(std::int64_t frames, double seconds) {
  return seconds > 0 ? static_cast<double>(frames) / seconds : 0;
}

}  // namespace

double RunReport::tracker_seconds() const {
  return stats.predict_seconds + stats.embed_seconds + stats.assign_seconds + stats.boost_seconds +
         stats.associate_seconds + stats.emit_seconds;
}

double RunReport::hz() const { return rate(stats.frames, tracker_seconds()); }

double RunReport::hz_without_embedding() const {
  return rate(stats.frames, tracker_seconds() - stats.embed_seconds);
}

void fit_to_picture(track::TrackerOptions& options, const FrameSource& frames,
                    const std::string& input) {
  if (options.output.amodal != track::OutputOptions::kInputSize) return;
  options.fit_to_picture(picture_size(frames, input), display_name(input));
}

RunReport run_sequence(FrameSource& frames, DetectionSource& detections, track::Tracker& tracker,
                       bool images, const RunObservers& observers) {
  const auto start = std::chrono::steady_clock::now();
  FrameTimes times;
  const auto deliver = [&](const std::vector<track::FinishedFrame>& finished) {
    for (const track::FinishedFrame& frame : finished) {
      const FrameTime time = times.take(frame.frame);
      if (observers.finished) observers.finished(frame, time);
    }
  };
  const auto warn = [&](const std::string& text) {
    if (observers.warning) observers.warning(text);
  };

  UnreadableFrames own(observers.warning);
  UnreadableFrames& unreadable = observers.unreadable != nullptr ? *observers.unreadable : own;
  const bool decode = images || observers.camera != nullptr || detections.needs_images();

  RunReport report;
  // In place of an image for a descriptor that needs none.
  const image::Image one_pixel(1, 1);
  const image::ImageView nothing = one_pixel.view();
  std::vector<image::PixelRect> people;
  RunState* const state = observers.state;
  if (state != nullptr) {
    std::vector<track::FinishedFrame> before;
    const int known =
        state->resume(tracker, [&](const track::FinishedFrame& done) { before.push_back(done); });
    Frame passed;
    for (int i = 1; i <= known && frames.repeatable() && frames.next(passed, false); ++i) {
      times.add(i, passed.when);
    }
    deliver(before);  // nothing of a camera, whose outputs go on where they were
  }
  const auto detect = [&](Look& look) {
    try {
      const io::Stopwatch watch(report.detect_seconds);
      look.boxes = detections.detect(look.frame);
      look.looked = detections.looked();
    } catch (const std::exception&) {
      look.failure = std::current_exception();
    }
  };
  // Where frames do not come at a pace of their own, they are decoded while others are tracked, and
  // detectors, which look at nothing else, look at them.
  const bool detects_ahead = detections.needs_images();
  std::optional<Ahead<Look>> ahead;
  if (decode && !frames.endless()) {
    const int threads = omp_get_max_threads();
    ahead.emplace([&, threads, failed = false](Look& look) mutable {
      omp_set_num_threads(threads);
      if (failed || !frames.next(look.frame, true)) return false;
      if (detects_ahead) detect(look);
      failed = look.failure != nullptr;
      return true;
    });
  }
  const auto next = [&](Look& look) {
    return ahead ? ahead->next(look) : frames.next(look.frame, decode);
  };
  bool stopped = false;
  Look look;
  const Frame& frame = look.frame;
  const std::vector<mot::Detection>& boxes = look.boxes;
  while (!(stopped = observers.stop && observers.stop()) && next(look)) {
    unreadable.add(frame, "the frame is tracked by motion alone");
    if (observers.read) observers.read(frame);
    const image::ImageView view = frame.image.view();
    if (!ahead || !detects_ahead) detect(look);
    if (look.failure != nullptr) {
      report.failure = look.failure;
      break;
    }
    if (detections.ended() && frames.endless()) {
      report.boxes_ended = true;
      break;
    }
    const bool visible = frame.has_image() || detections.descriptor() != nullptr;
    track::FrameContext context{
        .image = !visible            ? nullptr
                 : frame.has_image() ? &view
                                     : &nothing,
        .time = detections.time() ? detections.time() : times.on_one_clock(frame.when)};
    times.add(static_cast<int>(tracker.stats().frames) + 1, frame.when);
    if (observers.camera != nullptr && frame.has_image()) {
      people.clear();
      for (const mot::Detection& box : boxes) people.push_back(track::to_pixel_rect(box.box));
      context.camera = observers.camera->next(view, people);
      if (!context.camera) ++report.camera_lost;
      if (observers.camera_moved) observers.camera_moved(frame.number, context.camera);
    }
    const auto& finished = look.looked ? tracker.update(boxes, context) : tracker.skip(context);
    deliver(finished);
    if (observers.progress) {
      report.stats = tracker.stats();
      observers.progress(report);
    }
    if (state != nullptr) {
      if (!frames.live()) {
        for (const track::FinishedFrame& done : finished) state->add(done);
      }
      state->frame_done(tracker);
    }
  }
  ahead.reset();
  const int read = frame.number;
  stopped = stopped || report.failure != nullptr || report.boxes_ended;
  if (state != nullptr && stopped) state->save(tracker);
  // Some containers only estimate their length: a frame or two, or one in a hundred, say nothing.
  const int missing = frames.frame_count() - read;
  report.ended_early = !stopped && missing > std::max(2, frames.frame_count() / 100);
  if (report.ended_early) {
    warn(fmt::format("the input ends after {} of its {} frames; it is damaged or incomplete", read,
                     frames.frame_count()));
  }
  if (!stopped && detections.last_frame() > read) {
    warn(fmt::format("there are detections up to frame {}, but only {} frames; the rest is ignored",
                     detections.last_frame(), read));
  }
  deliver(tracker.finish());
  report.unreadable = unreadable.count();
  if (report.unreadable > 0 && report.unreadable == read) {
    throw std::invalid_argument(
        fmt::format("none of the {} frames could be read: {}", read, unreadable.first_problem()));
  }
  report.live = frames.live();
  report.stats = tracker.stats();
  report.scene = tracker.scene();
  report.total_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

}  // namespace sdmt::pipeline
