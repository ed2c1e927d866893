// SPDX-License-Identifier: Apache-2.0
#include "scene_calibration.h"

#include <algorithm>
#include <cstddef>

namespace sdmt::track {

namespace {

// The prior counts as much as so many observations, and the less the more there are: it may lie so
// far from what is seen that it would still move the rarest rates after a thousand.
constexpr double kPriorObservations = 30;
// A person may fail the gate of assignment by appearance alone this often.
constexpr double kOwnMisses = 0.01;
// Comparisons of whole tracks in a frame: each is of some hundred pairs of vectors.
constexpr std::size_t kMostTracks = 8;
// States of tracks that are compared as tracks, at least; fewer where galleries hold fewer.
constexpr int kGrownGallery = 10;

double blended(double learned, std::int64_t observations, double prior) {
  const double n = static_cast<double>(observations) / kPriorObservations;
  const double weight = n + n * n;
  return (weight * learned + prior) / (weight + 1);
}

double blended(const AffinityHistogram& seen, double share, double prior) {
  return seen.count() == 0 ? prior : blended(seen.exceeded_by(share), seen.count(), prior);
}

}  // namespace

SceneCalibration::SceneCalibration(const SceneOptions& options, const AppearanceOptions& appearance,
                                   const ConfidenceOptions& confidence, double prior)
    : options_(options), appearance_(appearance), confidence_(confidence) {
  report_.prior = prior;
  update();
}

void SceneCalibration::learn(int frame, const Tracklets& active, const FrameDetections& detections,
                             const ClearPairs& clear) {
  if (options_.learning != SceneLearning::on) return;
  seen_.clear();
  for (std::size_t i = 0; i < clear.detections(); ++i) {
    const int tracklet = clear.tracklet_of(i);
    if (tracklet < 0 || !detections.flags[i].embedded || active[tracklet]->gallery.empty())
      continue;
    seen_.push_back({active[tracklet].get(), i});
  }
  if (seen_.empty()) return;
  for (const Seen& one : seen_) {
    own_.add(1 - one.tracklet->gallery.distance(detections.feature(one.detection),
                                                appearance_.gallery_distance));
  }
  // Everybody with one other, all others in turn.
  const std::size_t others = seen_.size() - 1;
  for (std::size_t i = 0; i < seen_.size() && others > 0; ++i) {
    const std::size_t step = 1 + static_cast<std::size_t>(frame) % others;
    const Seen& one = seen_[i];
    const Seen& other = seen_[(i + step) % seen_.size()];
    if (mot::iou(detections.boxes[one.detection], detections.boxes[other.detection]) > 0) continue;
    strangers_.add(1 - one.tracklet->gallery.distance(detections.feature(other.detection),
                                                      appearance_.gallery_distance));
    const bool both = one.tracklet->confidence.positive(confidence_) &&
                      other.tracklet->confidence.positive(confidence_);
    const bool in_turn = (i + static_cast<std::size_t>(frame)) % seen_.size() < kMostTracks;
    if (!both || !in_turn) continue;
    // The nearest of few states is further away than that of tracks that have lived for a while.
    const std::size_t states =
        std::min(one.tracklet->gallery.size(), other.tracklet->gallery.size());
    if (states < static_cast<std::size_t>(std::min(kGrownGallery, appearance_.gallery_size)))
      continue;
    stranger_tracks_.add(
        1 - one.tracklet->gallery.distance(other.tracklet->gallery, appearance_.gallery_distance));
  }
  update();
}

void SceneCalibration::update() {
  report_.strangers = strangers_.count();
  report_.stranger_tracks = stranger_tracks_.count();
  report_.own = own_.count();
  const double prior = report_.prior, rate = options_.false_match_rate;
  report_.assignment_threshold = report_.association_threshold = prior;
  if (options_.learning == SceneLearning::off) return;
  const double between = blended(strangers_, rate, prior);
  report_.assignment_threshold = std::min(between, blended(own_, 1 - kOwnMisses, prior));
  report_.association_threshold = blended(stranger_tracks_, rate, prior);
  if (own_.count() == 0) return;
  const double right = own_.share_above(between);
  const double say = std::clamp((right - rate) / (1 - rate), 0.0, 1.0);
  report_.say = blended(say, own_.count(), 1);
}

int SceneCalibration::tenth(double score) {
  const int last = SceneReport::kTenths - 1;
  return static_cast<int>(std::clamp(score * SceneReport::kTenths, 0.0, static_cast<double>(last)));
}

void SceneCalibration::count(int tenth, bool person, int boxes) {
  report_.scores[tenth].boxes += boxes;
  if (person) report_.scores[tenth].people += boxes;
}

void SceneCalibration::give(Tracklet& tracklet, double score) {
  if (!tracklet.reported && !tracklet.confidence.positive(confidence_)) {
    ++tracklet.unsettled[tenth(score)];
    return;
  }
  count(tenth(score), true, 1);
  if (tracklet.unsettled == decltype(tracklet.unsettled){}) return;
  for (int i = 0; i < SceneReport::kTenths; ++i) count(i, true, tracklet.unsettled[i]);
  tracklet.unsettled.fill(0);
}

void SceneCalibration::forget(const Tracklet& tracklet) {
  for (int i = 0; i < SceneReport::kTenths; ++i) count(i, false, tracklet.unsettled[i]);
}

}  // namespace sdmt::track
