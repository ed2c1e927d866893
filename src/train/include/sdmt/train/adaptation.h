// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "sdmt/image/image.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/reid/roc.h"
#include "sdmt/train/scene_crops.h"

namespace sdmt::train {

/// What a network can learn of a scene from the tracks in it.
struct SceneLessons {
  SceneCrops teaching;
  SceneCrops held_out;  ///< of another time: chooses when to stop and tells what was gained
  /// Crops of any people, on which the network is to stay as it is. Empty: made up from those of
  /// the scene, upper halves on lower halves in other colours.
  std::vector<image::Image> anchors;
};

/// Least that a scene must have for adapt(), in either part.
struct LeastEvidence {
  static constexpr int kTracks = 4;           ///< that have met another
  static constexpr std::size_t kPairs = 200;  ///< of crops, of one person and of two
};

struct AdaptationOptions {
  std::int64_t iterations = 100;  ///< optimiser steps at most, >= 1
  std::uint64_t seed = 0;
  int tracks = 12;                ///< in a batch, of those there are; >= 2
  int instances = 4;              ///< crops of each, >= 2
  double learning_rate = 3e-4;    ///< of Adam at the first step, falls to a tenth; > 0
  double anchor_weight = 0.1;     ///< of the anchor against what the tracks teach, >= 0
  std::int64_t score_every = 10;  ///< steps, >= 1; also after the last
  int patience = 8;               ///< scorings in a row that find too little before it stops, >= 1

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

struct AdaptationStep {
  std::int64_t iteration = 0;         ///< counted from 1
  double loss = 0;                    ///< of the tracks
  double anchor_loss = 0;             ///< mean squared distance to the start's vectors
  const reid::Roc* scored = nullptr;  ///< on the part held out, where it is due
};

/// What came of it, on the part that was held out.
struct Adaptation {
  /// Share by which the area above the curve must fall.
  static constexpr double kLeastGain = 0.05;
  static constexpr double kTpr = 0.7;  ///< where false matches are compared

  std::int64_t iterations = 0;  ///< that the weights have taken; 0: none was better than the start
  reid::Roc before, after;

  /// The area above the curve fell by kLeastGain, and at kTpr there are no more false matches.
  bool gained() const;
};

/// Fine-tunes a network by the tracks of a scene, and leaves it as it was when nothing was gained.
///
/// Batches of crops far apart in time, of tracks that have met; batch-hard triplets with soft
/// margin, whose scale follows from the start's distances. Beside them anchors, in changing
/// colours, whose vectors are to remain the start's: they keep what the network knows of others.
/// Normalisations keep their statistics. Of networks above 1 GFLOP a crop only the head learns.
/// The latest weights are kept under whose curve of the part held out at least half of the largest
/// gain in area is left. The metadata says nothing of it yet.
///
/// The same for any number of threads. `progress` may throw to stop; the model is then to be thrown
/// away. Throws std::invalid_argument as the options do, and naming what a part lacks of
/// LeastEvidence.
Adaptation adapt(reid::Model& model, const SceneLessons& lessons, const AdaptationOptions& options,
                 const std::function<void(const AdaptationStep&)>& progress);

}  // namespace sdmt::train
