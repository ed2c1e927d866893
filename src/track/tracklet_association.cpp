// SPDX-License-Identifier: Apache-2.0
#include "tracklet_association.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sdmt::track {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Distance of the centres in units of the mean height.
double distance_in_heights(const mot::Cxcywh& a, const mot::Cxcywh& b) {
  return std::hypot(a.cx - b.cx, a.cy - b.cy) / std::max((a.height + b.height) / 2, 1e-9);
}

bool ordered(const AssociationPair& x, const AssociationPair& y) {
  return std::pair(x.older->id, x.newer->id) < std::pair(y.older->id, y.newer->id);
}

}  // namespace

void TrackletAssociation::run(int frame, std::vector<Tracklet*> tracklets,
                              const std::function<void(Tracklet&, Tracklet&)>& merge) {
  pairs_.clear();
  for (Tracklet* older : tracklets) {
    if (older->misses == 0) continue;
    for (Tracklet* newer : tracklets) {
      if (auto pair = judge(frame, *older, *newer)) pairs_.push_back(*pair);
    }
  }
  while (!pairs_.empty()) {
    const AssociationPair chosen = best();
    report(frame, *chosen.older, *chosen.newer, judges_appearance() ? chosen.score : kUnknown,
           AssociationVerdict::merged);
    std::erase_if(pairs_, [&](const AssociationPair& pair) {
      const bool same = pair.older == chosen.older && pair.newer == chosen.newer;
      const bool touched = pair.older == chosen.older || pair.newer == chosen.older ||
                           pair.older == chosen.newer || pair.newer == chosen.newer;
      if (touched && !same && (pair.older == chosen.older || pair.newer == chosen.newer)) {
        report(frame, *pair.older, *pair.newer, judges_appearance() ? pair.score : kUnknown,
               AssociationVerdict::better_pair);
      }
      return touched;
    });
    merge(*chosen.older, *chosen.newer);
    std::erase(tracklets, chosen.older);
    judge_all(frame, tracklets, *chosen.newer);
  }
}

void TrackletAssociation::judge_all(int frame, const std::vector<Tracklet*>& tracklets,
                                    Tracklet& with) {
  for (Tracklet* other : tracklets) {
    if (auto pair = judge(frame, *other, with)) pairs_.push_back(*pair);
    if (auto pair = judge(frame, with, *other)) pairs_.push_back(*pair);
  }
}

bool TrackletAssociation::within_reach(const mot::Cxcywh& predicted,
                                       const mot::Cxcywh& first) const {
  if (options_.reach > 0) return distance_in_heights(predicted, first) < options_.reach;
  return iou(mot::to_tlwh(predicted), mot::to_tlwh(first)) > 0;
}

// The two lead to each other: forwards and backwards.
std::optional<AssociationPair> TrackletAssociation::judge_motion(int frame, Tracklet& older,
                                                                 Tracklet& newer) const {
  constexpr double kTaller = 1.5;
  const mot::Cxcywh last = older.history.last_box();
  double miss = distance_in_heights(older.predicted(newer.first_frame), newer.first_box);
  if (miss < options_.motion_reach) {
    const mot::Cxcywh before =
        extrapolate(newer.history.start(), older.last_frame - newer.history.start_frame());
    miss = std::max(miss, distance_in_heights(before, last));
  }
  const double taller = last.height / newer.first_box.height;
  if (!(miss < options_.motion_reach) || taller > kTaller || taller < 1 / kTaller) {
    report(frame, older, newer, kUnknown, AssociationVerdict::too_far);
    return std::nullopt;
  }
  return AssociationPair{&older, &newer, -miss};
}

std::optional<AssociationPair> TrackletAssociation::judge(int frame, Tracklet& older,
                                                          Tracklet& newer) const {
  const int gap = newer.first_frame - older.last_frame;
  if (gap <= 0 || older.misses == 0) return std::nullopt;
  if (gap > motion_.max_misses + options_.horizon) {
    report(frame, older, newer, kUnknown, AssociationVerdict::too_late);
    return std::nullopt;
  }
  if (!judges_appearance()) return judge_motion(frame, older, newer);
  const mot::Cxcywh predicted = older.predicted(newer.first_frame);
  if (!within_reach(predicted, newer.first_box)) {
    report(frame, older, newer, kUnknown, AssociationVerdict::too_far);
    return std::nullopt;
  }
  if (older.gallery.empty() || newer.gallery.empty()) {
    report(frame, older, newer, kUnknown, AssociationVerdict::no_feature);
    return std::nullopt;
  }
  const double affinity = 1 - older.gallery.distance(newer.gallery, appearance_.gallery_distance);
  if (!(affinity > threshold())) {
    report(frame, older, newer, affinity, AssociationVerdict::appearance);
    return std::nullopt;
  }
  return AssociationPair{&older, &newer, affinity};
}

// Ties go to the lower ids. The listing serves the oldest tracklet that has a candidate first.
const AssociationPair& TrackletAssociation::best() const {
  return *std::max_element(pairs_.begin(), pairs_.end(),
                           [this](const AssociationPair& x, const AssociationPair& y) {
                             if (options_.literal && x.older->id != y.older->id) {
                               return x.older->id > y.older->id;
                             }
                             return x.score < y.score || (x.score == y.score && ordered(y, x));
                           });
}

void TrackletAssociation::report(int frame, const Tracklet& older, const Tracklet& newer,
                                 double affinity, AssociationVerdict verdict) const {
  if (!observer) return;
  const bool compared = !std::isnan(affinity);
  observer({frame, older.id, newer.id, newer.first_frame - older.last_frame, affinity,
            compared ? threshold() : kUnknown, verdict});
}

}  // namespace sdmt::track
