// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "cli/detection_arguments.h"
#include "cli/frame_range.h"
#include "cli/tracker_arguments.h"
#include "sdmt/train/scene_crops.h"

namespace sdmt::tools {

/// How a scene is looked at.
struct SceneView {
  DetectionArguments detections;
  TrackerArguments tracker;
  FrameRange frames;
  double held_out = 0.3;  ///< share of the time, at the end, that is held out, in (0, 1)
};

/// What the tracks of a scene have to teach. Crops lie in memory, nowhere else.
struct ObservedScene {
  std::string name;
  int frames = 0;
  int tracks = 0;
  train::SceneCrops teaching;
  train::SceneCrops held_out;
};

/// Tracks people through `input`, a MOT sequence, a folder of images or a video, and cuts crops of
/// them in a second pass. `progress` gets what is being done, the frames done and how many there
/// are, 0 where that is not known; it may throw to stop. Throws std::invalid_argument for a camera
/// or stream, for an input without images, and as `sdmt track`.
ObservedScene observe(const std::string& input, const SceneView& view, const Warning& warn,
                      const std::function<void(const char* what, int done, int total)>& progress);

}  // namespace sdmt::tools
