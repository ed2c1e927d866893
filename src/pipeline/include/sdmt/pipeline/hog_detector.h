// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/hog_options.h"

namespace sdmt::pipeline {

/// OpenCV's people detector (Dalal & Triggs, CVPR 2005: histograms of oriented gradients and a
/// linear SVM), there so that any video can be tracked without another file. It finds upright,
/// mostly unoccluded people from the front or behind; it misses people who sit, bend or are half
/// hidden, and takes poles and door frames for people. Anything serious should bring its own
/// detections.
///
/// Around a person many windows respond, around most other things only few. So windows with a
/// margin above -0.6 are taken: the strongest (margin m > 0) gathers those that overlap it by
/// IoU > 0.5, n with itself; the person's box is their mean, weighted by exp(margin), and its score
///
///     p = 1 / (1 + exp(-(2.15 m + 1.05 ln n - 2.71))),
///
/// about the share of true boxes. It then silences all that share more than 0.6 of the smaller of
/// the two boxes, for windows around two people or around a leg (Dollar et al., Integral Channel
/// Features, BMVC 2009, addendum), and the next strongest follows. Overlaps are those of the boxes
/// that people take in the windows. OpenCV tries no window that is larger than the picture, of
/// which a person fills three quarters; for those who are taller the picture is searched once more,
/// small, with a quarter of its height added on all sides, in the colours of its border.
/// scripts/fit-hog.py fits shares and score on PETS09-S2L1 and frames of seven MOT17 sequences;
/// what each says to the constants of the others is in docs/tracking.md.
class HogDetector : public DetectionSource {
 public:
  /// Throws as HogOptions::validate().
  explicit HogDetector(const HogOptions& options = {});
  ~HogDetector() override;

  /// A frame without an image has no detections.
  std::vector<mot::Detection> detect(const Frame& frame) override;
  bool needs_images() const override { return true; }

 private:
  struct Descriptor;

  HogOptions options_;
  std::unique_ptr<Descriptor> descriptor_;
};

}  // namespace sdmt::pipeline
