// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/train/scene_crops.h"

namespace sdmt::train {

// Draws what a step learns from the tracks of a scene: some tracks, where there are any those that
// have met one another, and of each some crops far apart in time. A batch depends on the seed and
// its number only.
class SceneBatches {
 public:
  // `crops` must outlive it; of each track they follow in time.
  SceneBatches(const SceneCrops& crops, int tracks, int instances, std::uint64_t seed);

  struct Batch {
    std::vector<int> images;  // indices into the crops, track after track
    std::vector<int> labels;  // the track of each
  };
  Batch batch(std::int64_t iteration) const;

 private:
  const SceneCrops& crops_;
  int tracks_;
  int instances_;
  std::uint64_t seed_;
  std::vector<std::vector<int>> by_track_;
};

}  // namespace sdmt::train
