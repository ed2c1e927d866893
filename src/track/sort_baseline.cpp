// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/sort_baseline.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sdmt/mot/assignment.h"

namespace sdmt::track {

namespace {

using State =
    Eigen::Matrix<double, 7, 1>;  // cx, cy, area, width / height, and the first three's velocity
using Covariance = Eigen::Matrix<double, 7, 7>;
using Measurement = Eigen::Vector4d;

Measurement measure(const mot::Tlwh& box) {
  return {box.left + box.width / 2, box.top + box.height / 2, box.width * box.height,
          box.width / box.height};
}

mot::Tlwh box_of(const State& x) {
  const double width = std::sqrt(x[2] * x[3]);
  const double height = x[2] / width;
  return {x[0] - width / 2, x[1] - height / 2, width, height};
}

bool is_finite(const mot::Tlwh& box) {
  return std::isfinite(box.left) && std::isfinite(box.top) && std::isfinite(box.width) &&
         std::isfinite(box.height);
}

Covariance transition() {
  Covariance f = Covariance::Identity();
  for (int i = 0; i < 3; ++i) f(i, i + 4) = 1;
  return f;
}

// The published implementation's noise.
const State kInitialVariance = (State() << 10, 10, 10, 10, 1e4, 1e4, 1e4).finished();
const State kProcessVariance = (State() << 1, 1, 1, 1, 0.01, 0.01, 0.0001).finished();
const Eigen::Vector4d kMeasurementVariance(1, 1, 10, 10);

}  // namespace

struct SortTracker::Track {
  int id;
  State x;
  Covariance p = kInitialVariance.asDiagonal();
  int time_since_update = 0;
  int hit_streak = 0;

  Track(int track_id, const mot::Tlwh& box) : id(track_id) { x << measure(box), 0, 0, 0; }

  void predict() {
    static const Covariance kTransition = transition();
    if (x[6] + x[2] <= 0) x[6] = 0;  // the area must not become negative
    x = kTransition * x;
    p = kTransition * p * kTransition.transpose();
    p.diagonal() += kProcessVariance;
    if (time_since_update > 0) hit_streak = 0;
    ++time_since_update;
  }

  void update(const mot::Tlwh& box) {
    time_since_update = 0;
    ++hit_streak;
    Eigen::Matrix4d innovation = p.topLeftCorner<4, 4>();
    innovation.diagonal() += kMeasurementVariance;
    const Eigen::Matrix<double, 7, 4> gain = p.leftCols<4>() * innovation.inverse();
    x += gain * (measure(box) - x.head<4>());
    Covariance rest = Covariance::Identity();
    rest.leftCols<4>() -= gain;
    p = rest * p * rest.transpose() + gain * kMeasurementVariance.asDiagonal() * gain.transpose();
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
  std::erase_if(tracks_, [](const Track& track) { return !is_finite(box_of(track.x)); });

  // Pairs below the threshold compete for the optimum and are dropped after it, as published.
  std::vector<mot::AssignmentEdge> edges;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      const double overlap = iou(detections[i].box, box_of(tracks_[j].x));
      if (overlap > 0) edges.push_back({static_cast<int>(i), static_cast<int>(j), overlap});
    }
  }
  const auto track_of = mot::maximum_weight_assignment(static_cast<int>(detections.size()),
                                                       static_cast<int>(tracks_.size()), edges);
  std::vector<const mot::Tlwh*> births;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const mot::Tlwh& box = detections[i].box;
    Track* track = track_of[i] < 0 ? nullptr : &tracks_[static_cast<std::size_t>(track_of[i])];
    if (track != nullptr && iou(box, box_of(track->x)) >= options_.iou_threshold) {
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
      finished.boxes.push_back({track.id, box_of(track.x), 1.0, BoxSource::detected});
    }
  }
  std::erase_if(tracks_,
                [this](const Track& track) { return track.time_since_update > options_.max_age; });
  return finished;
}

}  // namespace sdmt::track
