// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/sort_baseline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "coordinate_filter.h"
#include "sdmt/mot/assignment.h"

namespace sdmt::track {

namespace {

// SORT's filter of seven states falls apart into these: its transition, its noise and its
// measurements never mix centre x, centre y, area and aspect ratio.
using Coordinate = CoordinateFilter;

// The published implementation's noise.
constexpr double kProcessVariance = 1;
constexpr double kVelocityProcessVariance = 0.01;
constexpr double kAreaVelocityProcessVariance = 0.0001;
constexpr double kCentreVariance = 1;
constexpr double kShapeVariance = 10;

bool is_finite(const mot::Tlwh& box) {
  return std::isfinite(box.left) && std::isfinite(box.top) && std::isfinite(box.width) &&
         std::isfinite(box.height);
}

}  // namespace

struct SortTracker::Track {
  int id;
  Coordinate x, y;    // of the centre
  Coordinate area;    // width times height
  Coordinate aspect;  // width / height, taken as constant
  int time_since_update = 0;
  int hit_streak = 0;

  Track(int track_id, const mot::Tlwh& start)
      : id(track_id),
        x{start.left + start.width / 2},
        y{start.top + start.height / 2},
        area{start.width * start.height},
        aspect{.value = start.width / start.height, .velocity_variance = 0} {}

  mot::Tlwh box() const {
    const double width = std::sqrt(area.value * aspect.value);
    const double height = area.value / width;
    return {x.value - width / 2, y.value - height / 2, width, height};
  }

  void predict() {
    if (area.velocity + area.value <= 0) area.velocity = 0;  // an area must not become negative
    x.predict(kProcessVariance, kVelocityProcessVariance);
    y.predict(kProcessVariance, kVelocityProcessVariance);
    area.predict(kProcessVariance, kAreaVelocityProcessVariance);
    aspect.predict(kProcessVariance, 0);
    if (time_since_update > 0) hit_streak = 0;
    ++time_since_update;
  }

  void update(const mot::Tlwh& seen) {
    time_since_update = 0;
    ++hit_streak;
    x.update(seen.left + seen.width / 2, kCentreVariance);
    y.update(seen.top + seen.height / 2, kCentreVariance);
    area.update(seen.width * seen.height, kShapeVariance);
    aspect.update(seen.width / seen.height, kShapeVariance);
  }
};

void SortOptions::validate() const {
  const auto at_least_zero = [](const char* field, int value) {
    if (value < 0) {
      throw std::invalid_argument(std::string(field) + " is " + std::to_string(value) +
                                  ", expected >= 0");
    }
  };
  at_least_zero("max_age", max_age);
  at_least_zero("min_hits", min_hits);
  if (!(iou_threshold >= 0 && iou_threshold <= 1)) {
    throw std::invalid_argument("iou_threshold is " + std::to_string(iou_threshold) +
                                ", expected 0..1");
  }
}

SortTracker::SortTracker(const SortOptions& options) : options_(options) { options_.validate(); }
SortTracker::~SortTracker() = default;
SortTracker::SortTracker(SortTracker&&) noexcept = default;
SortTracker& SortTracker::operator=(SortTracker&&) noexcept = default;

FinishedFrame SortTracker::update(std::span<const mot::Detection> detections) {
  for (const mot::Detection& detection : detections) {
    if (!is_finite(detection.box) || detection.box.width <= 0 || detection.box.height <= 0) {
      throw std::invalid_argument("a detection's box is not finite or has no extent");
    }
  }
  ++frame_;
  for (Track& track : tracks_) track.predict();
  std::erase_if(tracks_, [](const Track& track) { return !is_finite(track.box()); });

  // Pairs below the threshold compete for the optimum and are dropped after it, as published.
  std::vector<mot::AssignmentEdge> edges;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      const double overlap = iou(detections[i].box, tracks_[j].box());
      if (overlap > 0) edges.push_back({static_cast<int>(i), static_cast<int>(j), overlap});
    }
  }
  const auto track_of = mot::maximum_weight_assignment(static_cast<int>(detections.size()),
                                                       static_cast<int>(tracks_.size()), edges);
  std::vector<const mot::Tlwh*> births;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const mot::Tlwh& box = detections[i].box;
    Track* track = track_of[i] < 0 ? nullptr : &tracks_[track_of[i]];
    if (track != nullptr && iou(box, track->box()) >= options_.iou_threshold) {
      track->update(box);
    } else {
      births.push_back(&box);
    }
  }
  for (const mot::Tlwh* box : births) tracks_.emplace_back(++last_id_, *box);

  FinishedFrame finished;
  finished.frame = frame_;
  for (const Track& track : tracks_) {
    if (track.time_since_update == 0 &&
        (track.hit_streak >= options_.min_hits || frame_ <= options_.min_hits)) {
      finished.boxes.push_back({track.id, track.box(), 1.0, BoxSource::detected});
    }
  }
  std::erase_if(tracks_,
                [this](const Track& track) { return track.time_since_update > options_.max_age; });
  return finished;
}

}  // namespace sdmt::track
