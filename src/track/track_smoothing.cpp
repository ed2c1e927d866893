// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/track_smoothing.h"

#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "body_shape.h"
#include "track_history.h"

namespace sdmt::track {

std::vector<FinishedFrame> smooth_tracks(std::span<const FinishedFrame> frames,
                                         const OutputOptions& output, const MotionOptions& motion) {
  TrackerOptions options;
  options.output = output;
  options.motion = motion;
  options.validate();
  const OutputRules rules(output, motion, std::numeric_limits<int>::max());
  struct Track {
    TrackHistory history;
    int first, last;
    BodyShape shape = {};
  };
  std::map<int, Track> tracks;
  for (const FinishedFrame& frame : frames) {
    if (frame.frame != frames.front().frame + static_cast<int>(&frame - frames.data())) {
      throw std::invalid_argument("frame " + std::to_string(frame.frame) +
                                  " is out of order, expected consecutive frames");
    }
    for (const TrackedBox& box : frame.boxes) {
      auto& track = tracks.try_emplace(box.id, Track{TrackHistory(rules), frame.frame, frame.frame})
                        .first->second;
      track.last = frame.frame;
      track.shape.see(box.box, output.amodal);
      const mot::Cxcywh measured = mot::to_cxcywh(box.box);
      track.history.append(frame.frame, measured, measured, box.score, box.source);
    }
  }
  std::vector<FinishedFrame> smoothed;
  for (const FinishedFrame& frame : frames) {
    FinishedFrame& out = smoothed.emplace_back(FinishedFrame{frame.frame, {}, frame.merges});
    for (auto& [id, track] : tracks) {
      if (frame.frame < track.first || frame.frame > track.last) continue;
      if (auto box = track.history.at(frame.frame)) {
        box->id = id;
        box->box = track.shape.whole(box->box, output.amodal);
        out.boxes.push_back(*box);
        track.history.forget(frame.frame);
      }
    }
  }
  return smoothed;
}

}  // namespace sdmt::track
