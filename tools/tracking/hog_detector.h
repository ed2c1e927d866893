// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/objdetect.hpp>
#include <vector>

#include "tracking/detection_source.h"

namespace sdmt::tools {

struct HogOptions {
  /// The smallest person looked for, pixels of height, 24..1000. The frame is resized so that such
  /// a person fills the detector's window; halving this quadruples the time.
  int min_person_height = 64;

  void validate() const;
};

/// OpenCV's people detector (Dalal & Triggs, CVPR 2005: histograms of oriented gradients and a
/// linear SVM), there so that any video can be tracked without another file. It finds upright,
/// mostly unoccluded people from the front or behind; it misses sitting, bent or half hidden ones
/// and likes poles and door frames. Anything serious should bring its own detections.
///
/// Windows are shrunk to the person inside them, overlapping ones (IoU > 0.4) suppressed, and the
/// SVM's margin s is mapped to p = 1 / (1 + exp(-(s - 0.8) / 0.35)), so that the score is about the
/// share of true boxes. These numbers were fitted on every 12th frame of PETS09-S2L1.
class HogDetector : public DetectionSource {
 public:
  explicit HogDetector(const HogOptions& options = {});

  /// A frame without an image has no detections.
  std::vector<track::Detection> detect(const Frame& frame) override;

 private:
  HogOptions options_;
  cv::HOGDescriptor descriptor_;
};

}  // namespace sdmt::tools
