// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "sdmt/image/camera_motion.h"
#include "sdmt/io/output_file.h"
#include "sdmt/track/tracker.h"

namespace sdmt::pipeline {

/// A CSV file of why: frame,older,newer,gap,affinity,threshold,verdict. A line for each of a
/// tracker's decisions about two tracklets; for each tracklet that never became a track, as newer;
/// and for each motion of the camera, from the picture before, in pixels and degrees.
class AssociationLog {
 public:
  /// Listens to `tracker`, which must not outlive it. Throws as io::OutputFile.
  AssociationLog(const std::string& path, track::Tracker& tracker);

  /// How the camera moved before a frame; nothing: that was not found.
  void camera(int frame, const std::optional<image::CameraMotion>& motion);

  /// Makes the file visible. Throws as io::OutputFile.
  void commit() { file_.commit(); }

 private:
  io::OutputFile file_;
};

}  // namespace sdmt::pipeline
