// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace sdmt::track {

/// Whether a tracker learns the scene that it looks at.
enum class SceneLearning {
  off,     ///< thresholds are those of the appearance model
  on,      ///< they are learned while it runs
  frozen,  ///< what a snapshot brought along holds, nothing is learned
};

/// What a tracker has learned of its scene, without labels: people seen at the same moment are
/// different people, and somebody whom motion alone leaves no doubt about is the same person.
struct SceneReport {
  double prior = 0;  ///< the threshold of the appearance model, from which it began
  /// Affinities that are asked for now: of a track and a detection, and of two tracks.
  double assignment_threshold = 0, association_threshold = 0;
  /// How well appearance tells people apart here, 0..1: the share of true pairs above the affinity
  /// that the wanted share of strangers exceeds, less what chance gives.
  double say = 1;
  /// Appearance tells so little here that tracks are joined by motion.
  bool all_look_alike() const { return say < 0.5; }
  /// Observed: tracks with other people's boxes, with other people's tracks, with their own boxes.
  std::int64_t strangers = 0, stranger_tracks = 0, own = 0;

  /// Boxes by their (calibrated) score, a tenth of 0..1 each, and how many of them belonged to
  /// people in the end.
  struct Scores {
    std::int64_t boxes = 0, people = 0;
  };
  static constexpr int kTenths = 10;
  std::array<Scores, kTenths> scores{};
};

}  // namespace sdmt::track
