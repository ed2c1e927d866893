// SPDX-License-Identifier: Apache-2.0
// How tracklets come to an end: they are forgotten, wait to be joined, or are joined.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "sdmt/io/stopwatch.h"
#include "tracker_state.h"

namespace sdmt::track {

// Moves tracklets that missed too often to the idle ones, and forgets those that nothing can come
// of: negative ones, which get no more detections, and old ones, behind which no tracklet can begin
// any more and be positive in time.
void Tracker::State::retire() {
  const int horizon = options.motion.max_misses + options.association.horizon;
  std::erase_if(idle, [&](const auto& tracklet) {
    const bool over = frame - tracklet->last_frame > horizon + options.auto_delay() &&
                      tracklet->last_frame <= output.decided();
    if (over) announce_end(*tracklet);
    return over;
  });
  bool sorted = true;
  for (auto& tracklet : active) {
    const int unseen = frame - tracklet->last_frame;
    if ((tracklet->misses == 0 || unseen < options.motion.max_misses) && unseen <= horizon)
      continue;
    if (tracklet->reported || tracklet->confidence.positive(options.confidence)) {
      sorted = sorted && (idle.empty() || idle.back()->id < tracklet->id);
      idle.push_back(std::move(tracklet));
    } else {
      give_up(*tracklet);
      tracklet.reset();
    }
  }
  std::erase(active, nullptr);
  if (!sorted) {
    std::sort(idle.begin(), idle.end(), [](const auto& x, const auto& y) { return x->id < y->id; });
  }
}

void Tracker::State::give_up(const Tracklet& tracklet) {
  scene.forget(tracklet);
  if (!tracklet_dropped) return;
  const auto& confidence = tracklet.confidence;
  tracklet_dropped({frame, tracklet.id, tracklet.first_frame, tracklet.last_frame,
                    confidence.length, confidence.score_sum / confidence.length});
}

void Tracker::State::announce_end(const Tracklet& tracklet) const {
  if (!track_ended || !tracklet.reported) return;
  track_ended({tracklet.id, tracklet.first_frame, tracklet.last_frame, tracklet.gallery});
}

void Tracker::State::end_all() {
  std::vector<const Tracklet*> left;
  for (const Tracklets* group : {&idle, &active}) {
    for (const auto& tracklet : *group) left.push_back(tracklet.get());
  }
  std::sort(left.begin(), left.end(), [](auto* x, auto* y) { return x->id < y->id; });
  for (const Tracklet* tracklet : left) announce_end(*tracklet);
}

void Tracker::State::associate() {
  if (!options.association.enabled) return;
  if (descriptor == nullptr && !options.association.by_motion) return;
  const io::Stopwatch watch(stats.associate_seconds);
  std::vector<Tracklet*> positive;
  for (const Tracklets* group : {&idle, &active}) {
    for (const auto& tracklet : *group) {
      if (tracklet->confidence.positive(options.confidence)) positive.push_back(tracklet.get());
    }
  }
  const auto by_id = [](const auto& x, const auto& y) { return x->id < y->id; };
  std::sort(positive.begin(), positive.end(), by_id);
  const auto merges = stats.merges;
  association.run(frame, std::move(positive),
                  [this](Tracklet& older, Tracklet& newer) { merge(older, newer); });
  if (stats.merges == merges) return;
  std::sort(active.begin(), active.end(), by_id);
  std::sort(idle.begin(), idle.end(), by_id);
}

void Tracker::State::merge(Tracklet& older, Tracklet& newer) {
  ++stats.merges;
  output.announce_merge(older, newer);
  newer.absorb(older, output.decided());
  for (Tracklets* group : {&idle, &active}) {
    std::erase_if(*group, [&older](const auto& tracklet) { return tracklet.get() == &older; });
  }
}

}  // namespace sdmt::track
