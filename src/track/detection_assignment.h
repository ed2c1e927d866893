// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "frame_detections.h"
#include "sdmt/mot/assignment.h"
#include "sdmt/mot/overlaps.h"
#include "sdmt/track/scene.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// A detection given to a tracklet.
struct Match {
  int tracklet = 0;
  int detection = 0;
  double affinity = 0;  ///< equation 4
};

/// Detection assignment (section III-D, algorithm 1). Keeps its memory between frames.
class DetectionAssignment {
 public:
  DetectionAssignment(const AssignmentOptions& options, const AppearanceOptions& appearance,
                      const SceneReport& scene)
      : options_(options), appearance_(appearance), scene_(scene) {}

  /// The pairs of active tracklets (their predictions) and detections that pass the motion gate;
  /// to be called again when detections were added. `skipped`: frames since the last look
  /// at which nobody looked; for each of them boxes are compared that are wider all around.
  void gate(const Tracklets& active, const FrameDetections& detections, int skipped = 0);
  const std::vector<mot::Overlap>& gated() const { return gated_; }

  /// The matches of greatest total affinity among gated pairs that pass the appearance gate,
  /// ordered by tracklet: strong detections first, then what is left with weak ones by motion
  /// alone. A pair of which one side has no appearance is judged by motion alone. A pair of
  /// affinity <= 0 is not matched.
  const std::vector<Match>& assign(const Tracklets& active, const FrameDetections& detections);

 private:
  void assign_strong(const Tracklets& active, const FrameDetections& detections);
  void assign_weak(const Tracklets& active, const FrameDetections& detections);
  void take_best(std::size_t tracklets, std::size_t detections);
  bool affinity(const Tracklet& tracklet, const FrameDetections& detections,
                const mot::Overlap& pair, double& value) const;

  const AssignmentOptions& options_;
  const AppearanceOptions& appearance_;
  const SceneReport& scene_;  // its threshold and say
  mot::OverlapFinder overlaps_;
  std::vector<mot::Tlwh> predictions_, widened_;
  std::vector<mot::Overlap> gated_;
  std::vector<mot::AssignmentEdge> edges_;
  std::vector<int> detection_of_;  // [tracklets], -1 none
  std::vector<bool> taken_;        // [detections]
  std::vector<Match> matches_;
};

}  // namespace sdmt::track
