// SPDX-License-Identifier: Apache-2.0
#include "unclaimed_detections.h"

#include <algorithm>
#include <cstddef>

#include "camera_warp.h"

namespace sdmt::track {

UnclaimedDetections::UnclaimedDetections(const TrackerOptions& options, const KalmanFilter& filter,
                                         const OutputRules& rules)
    : options_(options), filter_(filter), rules_(rules) {}

void UnclaimedDetections::begin_frame(int frame) {
  frames_.push_back({frame, {}});
  const int kept = options_.motion.look_back + options_.confirmation_frames();
  while (frames_.front().frame < frame - kept) frames_.pop_front();
}

void UnclaimedDetections::warp(const image::CameraMotion& motion) {
  for (Frame& frame : frames_) {
    for (mot::Detection& detection : frame.boxes) detection.box = warped(detection.box, motion);
  }
}

std::optional<TrackHistory> UnclaimedDetections::claim(KalmanState state, int frame, int decided) {
  const int earliest = std::max(frame - options_.motion.look_back, decided + 1);
  struct Claimed {
    int frame;
    mot::Detection detection;
  };
  std::vector<Claimed> claimed;  // latest first
  for (double& velocity : state.velocity) velocity = -velocity;
  state.covariance = -state.covariance;
  int misses = 0;
  for (auto at = frames_.rbegin();
       at != frames_.rend() && at->frame >= earliest && misses < options_.motion.max_misses; ++at) {
    if (at->frame >= frame) continue;
    state = filter_.predict(state, frame - at->frame);
    frame = at->frame;
    const mot::Tlwh expected = mot::to_tlwh(state.box());
    auto& boxes = at->boxes;
    const auto overlap = [&](const mot::Detection& box) { return mot::iou(expected, box.box); };
    const auto best =
        std::max_element(boxes.begin(), boxes.end(),
                         [&](const auto& x, const auto& y) { return overlap(x) < overlap(y); });
    ++misses;
    if (best == boxes.end() || !(overlap(*best) > options_.assignment.weak_iou)) continue;
    misses = 0;
    state = filter_.update(state, mot::to_cxcywh(best->box), rules_.looseness(best->score));
    claimed.push_back({frame, *best});
    boxes.erase(best);
  }
  if (claimed.empty()) return std::nullopt;
  TrackHistory history(rules_);
  for (auto it = claimed.rbegin(); it != claimed.rend(); ++it) {
    const mot::Cxcywh box = mot::to_cxcywh(it->detection.box);
    history.append(it->frame, box, box, it->detection.score, BoxSource::detected);
  }
  return history;
}

}  // namespace sdmt::track
