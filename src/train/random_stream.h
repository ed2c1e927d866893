// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "sdmt/nn/random.h"

namespace sdmt::train {

/// What a random number of a training is for. Every number comes from a generator made for its
/// purpose and place, so that it depends on neither the threads nor what was drawn before: the
/// iteration is all that a checkpoint needs to remember.
enum class Purpose : std::uint64_t {
  weights,
  holdout,
  identity_order,
  images,
  view,
  augmentation,
  unlabelled,
  scene_batch,
  scene_anchors
};

/// The generator for the a-th, b-th use of a purpose; a < 2^24, b < 2^32.
inline nn::Random random_stream(std::uint64_t seed, Purpose purpose, std::uint64_t a = 0,
                                std::uint64_t b = 0) {
  return nn::Random(seed, static_cast<std::uint64_t>(purpose) << 56 | a << 32 | b);
}

}  // namespace sdmt::train
