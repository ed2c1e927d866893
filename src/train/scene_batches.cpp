// SPDX-License-Identifier: Apache-2.0
#include "scene_batches.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "random_stream.h"

namespace sdmt::train {

namespace {

// Each next one has met one before it, where there is such a track left.
std::vector<int> draw_tracks(const Meetings& met, int wanted, nn::Random& random) {
  std::vector<int> order(static_cast<std::size_t>(met.tracks()));
  std::iota(order.begin(), order.end(), 0);
  random.shuffle(std::span<int>(order));
  std::vector<int> chosen;
  while (!order.empty() && static_cast<int>(chosen.size()) < wanted) {
    auto next = std::find_if(order.begin(), order.end(), [&](int track) {
      return std::any_of(chosen.begin(), chosen.end(),
                         [&](int other) { return met(track, other); });
    });
    if (next == order.end()) next = order.begin();
    chosen.push_back(*next);
    order.erase(next);
  }
  return chosen;
}

}  // namespace

SceneBatches::SceneBatches(const SceneCrops& crops, int tracks, int instances, std::uint64_t seed)
    : crops_(crops),
      tracks_(tracks),
      instances_(instances),
      seed_(seed),
      by_track_(static_cast<std::size_t>(crops.met.tracks())) {
  for (int i = 0; i < static_cast<int>(crops.tracks.size()); ++i) {
    by_track_[crops.tracks[i]].push_back(i);
  }
}

SceneBatches::Batch SceneBatches::batch(std::int64_t iteration) const {
  auto random =
      random_stream(seed_, Purpose::scene_batch, 0, static_cast<std::uint64_t>(iteration));
  Batch batch;
  const auto pieces = static_cast<std::size_t>(instances_);
  for (const int track : draw_tracks(crops_.met, tracks_, random)) {
    // One of each piece of the track's time.
    const std::vector<int>& crops = by_track_[track];
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      const std::size_t first = piece * crops.size() / pieces;
      const std::size_t end = std::max(first + 1, (piece + 1) * crops.size() / pieces);
      batch.images.push_back(crops[first + random.below(end - first)]);
      batch.labels.push_back(track);
    }
  }
  return batch;
}

}  // namespace sdmt::train
