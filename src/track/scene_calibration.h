// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "affinity_histogram.h"
#include "clear_pairs.h"
#include "frame_detections.h"
#include "sdmt/track/scene.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Learns how alike people look in this scene, and takes the thresholds of appearance from it
/// (SceneOptions). Only pairs that are clear by motion count, and people at the same moment whose
/// boxes do not touch; so it needs a prior by which people are followed at all.
class SceneCalibration {
 public:
  /// `prior`: the appearance model's threshold, which counts as much as the first observations.
  SceneCalibration(const SceneOptions& options, const AppearanceOptions& appearance,
                   const ConfidenceOptions& confidence, double prior);

  const SceneReport& report() const { return report_; }

  /// The embedded detections of a frame, before they are stored.
  void learn(int frame, const Tracklets& active, const FrameDetections& detections,
             const ClearPairs& clear);

  /// A detection, by its score, was given to a tracklet; or to none; or a tracklet came to nothing.
  void give(Tracklet& tracklet, double score);
  void leave(double score) { count(tenth(score), false, 1); }
  void forget(const Tracklet& tracklet);

 private:
  friend struct Snapshot;

  struct Seen {
    const Tracklet* tracklet;
    std::size_t detection;
  };
  static int tenth(double score);
  void count(int tenth, bool person, int boxes);
  void update();

  const SceneOptions& options_;
  const AppearanceOptions& appearance_;
  const ConfidenceOptions& confidence_;
  AffinityHistogram strangers_, stranger_tracks_, own_;
  SceneReport report_;
  std::vector<Seen> seen_;
};

}  // namespace sdmt::track
