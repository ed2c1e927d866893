// SPDX-License-Identifier: Apache-2.0
#include "track_output.h"

#include <algorithm>
#include <utility>

#include "camera_warp.h"

namespace sdmt::track {

TrackOutput::TrackOutput(const OutputOptions& options, const MotionOptions& motion,
                         const ConfidenceOptions& confidence, int lag)
    : options_(options), confidence_(confidence), rules_(options, motion, lag), lag_(lag) {}

void TrackOutput::announce_merge(const Tracklet& older, const Tracklet& newer) {
  if (newer.reported) merges_.push_back({newer.id, older.id});
}

void TrackOutput::warp(const image::CameraMotion& motion) {
  const image::CameraMotion back = motion.inverse();
  for (Waiting& waiting : waiting_) waiting.back = back.then(waiting.back);
}

void TrackOutput::emit(int frame, bool at_end, Tracklets& active, Tracklets& idle,
                       std::int64_t& tracks) {
  const int due = at_end ? frame : frame - lag_;
  for (; !waiting_.empty() && waiting_.front().frame <= due; waiting_.pop_front()) {
    decided_ = waiting_.front().frame;
    FinishedFrame& done = held_.emplace_back(Held{decided_, {}}).finished;
    done.frame = ++reported_;
    done.merges = std::exchange(merges_, {});
    decide(waiting_.front(), idle, done.boxes, tracks);
    decide(waiting_.front(), active, done.boxes, tracks);
    std::sort(done.boxes.begin(), done.boxes.end(),
              [](const TrackedBox& x, const TrackedBox& y) { return x.id < y.id; });
  }
  finished_.clear();
  const int delay = options_.delay == OutputOptions::kAutoDelay ? lag_ : options_.delay;
  while (!held_.empty() && (at_end || frame - delay >= held_.front().frame)) {
    finished_.push_back(std::move(held_.front().finished));
    held_.pop_front();
  }
}

void TrackOutput::decide(const Waiting& waiting, Tracklets& tracklets,
                         std::vector<TrackedBox>& boxes, std::int64_t& tracks) {
  const int frame = waiting.frame;
  for (const auto& tracklet : tracklets) {
    if (frame < tracklet->first_frame) continue;
    if (tracklet->reported || tracklet->confidence.positive(confidence_)) {
      if (auto box = tracklet->history.at(frame)) {
        box->id = tracklet->id;
        if (!waiting.back.is_still()) box->box = warped(box->box, waiting.back);
        box->box = tracklet->shape.whole(box->box, options_.amodal);
        boxes.push_back(*box);
        tracks += tracklet->reported ? 0 : 1;
        tracklet->reported = true;
      }
    }
    tracklet->history.forget(frame);
  }
}

}  // namespace sdmt::track
