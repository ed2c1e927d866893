// SPDX-License-Identifier: Apache-2.0
#include "detection_assignment.h"

#include <algorithm>
#include <cstddef>

namespace sdmt::track {

namespace {

// Where people may be who changed their course while nobody looked: so far around their boxes, in
// heights a frame.
constexpr double kSpread = 0.05;

mot::Tlwh widened(const mot::Tlwh& box, double heights) {
  const double margin = heights * box.height;
  return {box.left - margin, box.top - margin, box.width + 2 * margin, box.height + 2 * margin};
}

}  // namespace

void DetectionAssignment::gate(const Tracklets& active, const FrameDetections& detections,
                               int skipped) {
  const double spread = kSpread * skipped;
  predictions_.clear();
  for (const auto& tracklet : active) predictions_.push_back(mot::to_tlwh(tracklet->state.box()));
  const std::vector<mot::Tlwh>* boxes = &detections.boxes;
  if (skipped > 0) {
    for (mot::Tlwh& box : predictions_) box = widened(box, spread);
    widened_.clear();
    for (const mot::Tlwh& box : detections.boxes) widened_.push_back(widened(box, spread));
    boxes = &widened_;
  }
  const auto& overlaps =
      overlaps_.find(predictions_, *boxes, std::min(options_.min_iou, options_.weak_iou));
  gated_.clear();
  for (const mot::Overlap& pair : overlaps) {
    const auto& flags = detections.flags[pair.b];
    const double bound = flags.strong ? options_.min_iou : options_.weak_iou;
    if (!flags.dropped && pair.iou > bound) gated_.push_back(pair);
  }
}

const std::vector<Match>& DetectionAssignment::assign(const Tracklets& active,
                                                      const FrameDetections& detections) {
  detection_of_.assign(active.size(), -1);
  taken_.assign(detections.size(), false);
  matches_.clear();
  assign_strong(active, detections);
  assign_weak(active, detections);
  std::sort(matches_.begin(), matches_.end(),
            [](const Match& x, const Match& y) { return x.tracklet < y.tracklet; });
  return matches_;
}

void DetectionAssignment::assign_strong(const Tracklets& active,
                                        const FrameDetections& detections) {
  edges_.clear();
  for (const mot::Overlap& pair : gated_) {
    if (!detections.flags[pair.b].strong) continue;
    double value = 0;
    if (!affinity(*active[pair.a], detections, pair, value)) continue;
    edges_.push_back({pair.a, pair.b, value});
  }
  take_best(active.size(), detections.size());
}

void DetectionAssignment::assign_weak(const Tracklets& active, const FrameDetections& detections) {
  edges_.clear();
  for (const mot::Overlap& pair : gated_) {
    if (detections.flags[pair.b].strong) continue;
    if (detection_of_[pair.a] >= 0) continue;
    edges_.push_back({pair.a, pair.b, pair.iou});
  }
  if (!edges_.empty()) take_best(active.size(), detections.size());
}

// Adds the best assignment over edges_ to the matches.
void DetectionAssignment::take_best(std::size_t tracklets, std::size_t detections) {
  const auto best = mot::maximum_weight_assignment(static_cast<int>(tracklets),
                                                   static_cast<int>(detections), edges_);
  for (const mot::AssignmentEdge& edge : edges_) {
    if (best[edge.row] != edge.column) continue;
    detection_of_[edge.row] = edge.column;
    matches_.push_back({edge.row, edge.column, edge.weight});
  }
}

// Equation 4; false when the pair fails the appearance gate.
bool DetectionAssignment::affinity(const Tracklet& tracklet, const FrameDetections& detections,
                                   const mot::Overlap& pair, double& value) const {
  const double floor = options_.rescale_affinity ? options_.min_iou : 0.0;
  const double motion = (pair.iou - floor) / (1 - floor);
  value = motion;
  const int detection = pair.b;
  if (!detections.flags[detection].embedded || tracklet.gallery.empty()) return true;
  if (!options_.appearance_gate && options_.lambda <= 0) return true;
  const double threshold = scene_.assignment_threshold;
  double appearance =
      1 - tracklet.gallery.distance(detections.feature(detection), appearance_.gallery_distance);
  if (options_.appearance_gate && !(appearance > threshold)) return false;
  if (options_.rescale_affinity) appearance = (appearance - threshold) / (1 - threshold);
  const double lambda = options_.lambda * scene_.say;
  value = lambda * appearance + (1 - lambda) * motion;
  return true;
}

}  // namespace sdmt::track
