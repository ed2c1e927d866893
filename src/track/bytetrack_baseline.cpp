// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/bytetrack_baseline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "coordinate_filter.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/mot/assignment.h"

namespace sdmt::track {

namespace {

// The published implementation's costs (1 - IoU) beyond which nothing is matched.
constexpr double kFirstCost = 0.8, kWeakCost = 0.5, kUnconfirmedCost = 0.7;
constexpr double kDuplicateCost = 0.15;

// Its noise: standard deviations in heights; those of the aspect ratio are absolute.
constexpr double kPosition = 1.0 / 20, kVelocity = 1.0 / 160;
constexpr double kAspect = 1e-2, kAspectVelocity = 1e-5, kMeasuredAspect = 1e-1;

constexpr double square(double x) { return x * x; }

// Its IoU, in which a box from pixel 3 to pixel 5 is three pixels wide.
double pixel_iou(const mot::Tlwh& a, const mot::Tlwh& b) {
  return mot::iou({a.left, a.top, a.width + 1, a.height + 1},
                  {b.left, b.top, b.width + 1, b.height + 1});
}

}  // namespace

struct ByteTracker::Track {
  int id;
  int start_frame, last_frame;
  bool confirmed;
  bool lost = false;
  double score;
  mot::Tlwh seen_box;
  CoordinateFilter x, y, aspect, height;

  Track(int track_id, int frame, const mot::Detection& seen)
      : id(track_id),
        start_frame(frame),
        last_frame(frame),
        confirmed(frame == 1),
        score(seen.score),
        seen_box(seen.box),
        x(start(seen.box.left + seen.box.width / 2, seen.box.height)),
        y(start(seen.box.top + seen.box.height / 2, seen.box.height)),
        aspect{.value = seen.box.width / seen.box.height,
               .variance = square(kAspect),
               .velocity_variance = square(kAspectVelocity)},
        height(start(seen.box.height, seen.box.height)) {}

  static CoordinateFilter start(double value, double height) {
    return {.value = value,
            .variance = square(2 * kPosition * height),
            .velocity_variance = square(10 * kVelocity * height)};
  }

  mot::Tlwh box() const {
    const double width = aspect.value * height.value;
    return {x.value - width / 2, y.value - height.value / 2, width, height.value};
  }

  void predict() {
    if (lost) height.velocity = 0;
    const double position = square(kPosition * height.value);
    const double velocity = square(kVelocity * height.value);
    x.predict(position, velocity);
    y.predict(position, velocity);
    aspect.predict(square(kAspect), square(kAspectVelocity));
    height.predict(position, velocity);
  }

  void update(int frame, const mot::Detection& seen) {
    const double variance = square(kPosition * height.value);
    x.update(seen.box.left + seen.box.width / 2, variance);
    y.update(seen.box.top + seen.box.height / 2, variance);
    aspect.update(seen.box.width / seen.box.height, square(kMeasuredAspect));
    height.update(seen.box.height, variance);
    score = seen.score;
    seen_box = seen.box;
    last_frame = frame;
    lost = false;
    confirmed = true;
  }
};

struct ByteTracker::Matching {
  std::vector<int> detection_of;  // [tracks], -1 none
  std::vector<mot::Detection> left;
};

void ByteTrackOptions::validate() const {
  io::require_in("track_threshold", track_threshold, 0, 1);
  io::require_in("birth_margin", birth_margin, 0, 1);
  io::require_in("low_threshold", low_threshold, 0, 1);
  io::require(max_lost >= 0, "max_lost", max_lost, ">= 0");
  if (report == ReportBox::smoothed) {
    throw std::invalid_argument(
        "report is smoothed, expected filtered or detection; see smooth_tracks()");
  }
}

ByteTracker::ByteTracker(const ByteTrackOptions& options) : options_(options) {
  options_.validate();
}
ByteTracker::~ByteTracker() = default;
ByteTracker::ByteTracker(ByteTracker&&) noexcept = default;
ByteTracker& ByteTracker::operator=(ByteTracker&&) noexcept = default;

// The assignment of least cost in which leaving a pair alone costs `largest_cost`.
ByteTracker::Matching ByteTracker::match(const std::vector<Track*>& tracks,
                                         const std::vector<mot::Detection>& detections,
                                         double largest_cost, bool fuse) const {
  std::vector<mot::AssignmentEdge> edges;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const mot::Tlwh box = tracks[i]->box();
    for (std::size_t j = 0; j < detections.size(); ++j) {
      const double fit = pixel_iou(box, detections[j].box) * (fuse ? detections[j].score : 1);
      const double gain = largest_cost - (1 - fit);
      if (gain > 0) edges.push_back({static_cast<int>(i), static_cast<int>(j), gain});
    }
  }
  Matching matching;
  matching.detection_of = mot::maximum_weight_assignment(
      static_cast<int>(tracks.size()), static_cast<int>(detections.size()), edges);
  std::vector<bool> taken(detections.size(), false);
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const int j = matching.detection_of[i];
    if (j < 0) continue;
    taken[j] = true;
    tracks[i]->update(frame_, detections[j]);
  }
  for (std::size_t j = 0; j < detections.size(); ++j) {
    if (!taken[j]) matching.left.push_back(detections[j]);
  }
  return matching;
}

FinishedFrame ByteTracker::update(std::span<const mot::Detection> detections) {
  std::vector<mot::Detection> strong, weak;
  for (const mot::Detection& detection : detections) {
    const mot::Tlwh& box = detection.box;
    if (!std::isfinite(box.left + box.top + box.width + box.height) || !(box.width > 0) ||
        !(box.height > 0)) {
      throw std::invalid_argument("a detection's box is not finite or has no extent");
    }
    if (detection.score > options_.track_threshold) {
      strong.push_back(detection);
    } else if (detection.score > options_.low_threshold &&
               detection.score < options_.track_threshold) {
      weak.push_back(detection);
    }
  }
  ++frame_;
  std::vector<Track*> known, unconfirmed;
  for (const auto& track : tracks_) (track->confirmed ? known : unconfirmed).push_back(track.get());
  for (Track* track : known) track->predict();

  const Matching first = match(known, strong, kFirstCost, options_.fuse_scores);
  std::vector<Track*> missed;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (first.detection_of[i] < 0 && !known[i]->lost) missed.push_back(known[i]);
  }
  const Matching second = match(missed, weak, kWeakCost, false);
  for (std::size_t i = 0; i < missed.size(); ++i) {
    if (second.detection_of[i] < 0) missed[i]->lost = true;
  }
  const Matching third = match(unconfirmed, first.left, kUnconfirmedCost, options_.fuse_scores);
  std::erase_if(tracks_, [this](const auto& track) {
    return !track->confirmed || (track->lost && frame_ - track->last_frame > options_.max_lost);
  });
  for (const mot::Detection& detection : third.left) {
    if (detection.score < options_.track_threshold + options_.birth_margin) continue;
    tracks_.push_back(std::make_unique<Track>(++last_id_, frame_, detection));
  }
  drop_duplicates();

  FinishedFrame finished;
  finished.frame = frame_;
  for (const auto& track : tracks_) {
    if (track->lost || !track->confirmed) continue;
    const bool filtered = options_.report == ReportBox::filtered;
    finished.boxes.push_back(
        {track->id, filtered ? track->box() : track->seen_box, track->score, BoxSource::detected});
  }
  return finished;
}

// Of a track and a lost one in the same place the older stays.
void ByteTracker::drop_duplicates() {
  std::vector<const Track*> dropped;
  for (const auto& track : tracks_) {
    if (track->lost) continue;
    for (const auto& lost : tracks_) {
      if (!lost->lost || 1 - pixel_iou(track->box(), lost->box()) >= kDuplicateCost) continue;
      const bool older =
          track->last_frame - track->start_frame > lost->last_frame - lost->start_frame;
      dropped.push_back(older ? lost.get() : track.get());
    }
  }
  std::erase_if(tracks_, [&](const auto& track) {
    return std::find(dropped.begin(), dropped.end(), track.get()) != dropped.end();
  });
}

}  // namespace sdmt::track
