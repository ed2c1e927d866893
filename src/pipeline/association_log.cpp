// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/association_log.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

namespace sdmt::pipeline {

AssociationLog::AssociationLog(const std::string& path, track::Tracker& tracker) : file_(path) {
  file_.write("frame,older,newer,gap,affinity,threshold,verdict\n");
  tracker.on_association([this](const track::AssociationDecision& decision) {
    file_.write(fmt::format("{},{},{},{},{:.4f},{:.4f},{}\n", decision.frame, decision.older,
                            decision.newer, decision.gap, decision.affinity, decision.threshold,
                            track::to_string(decision.verdict)));
  });
  tracker.on_dropped([this](const track::DroppedTracklet& dropped) {
    file_.write(fmt::format("{},,{},,,,never a track: {} detections of mean score {:.2f}\n",
                            dropped.frame, dropped.id, dropped.length, dropped.mean_score));
  });
}

void AssociationLog::camera(int frame, const std::optional<image::CameraMotion>& motion) {
  if (motion && motion->is_still()) return;
  constexpr double kDegrees = 180 / std::numbers::pi;
  file_.write(motion ? fmt::format("{},,,,,,the camera moved: shift {:.1f} {:.1f} zoom {:.4f} roll "
                                   "{:.2f}\n",
                                   frame, motion->tx, motion->ty, motion->scale(),
                                   std::atan2(motion->b, motion->a) * kDegrees)
                     : fmt::format("{},,,,,,how the camera moved was not found\n", frame));
}

}  // namespace sdmt::pipeline
