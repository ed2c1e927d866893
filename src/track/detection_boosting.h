// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detection_assignment.h"
#include "frame_detections.h"
#include "sdmt/image/crop_descriptor.h"
#include "sdmt/image/image_view.h"
#include "sdmt/mot/overlaps.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Detection boosting (section III-F): looks for people whom the detector missed. Around the
/// prediction of each positive tracklet without a detection, boosted less than every `interval`
/// frames, boxes are sampled densely: grid x grid shifts of up to `reach` widths and heights, in
/// one size or three. They are clipped to the image and all embedded in one batch; with one_pass
/// those inside the image are embedded by CropDescriptor::describe_shifted(), size by size, and
/// those that leave it are left out. The one closest in appearance joins the detections when its
/// affinity is above the threshold by more than `margin`.
class DetectionBoosting {
 public:
  DetectionBoosting(const BoostingOptions& options, const AppearanceOptions& appearance,
                    const ConfidenceOptions& confidence, const SceneReport& scene)
      : options_(options), appearance_(appearance), confidence_(confidence), scene_(scene) {}

  /// Appends the boosted boxes to `detections`, if any, and then marks those dropped that overlap a
  /// better one by more than `nms`, the detector's among them: those by score, after them the
  /// boosted ones by affinity. Returns how many boosted boxes are left. `matches` are those of the
  /// first assignment.
  int boost(int frame, const image::ImageView& image, image::CropDescriptor& descriptor,
            const Tracklets& active, std::span<const Match> matches, FrameDetections& detections);

  /// Whether the last call left a boosted box or dropped one of the detector's: the matches must
  /// then be made anew.
  bool changed() const { return changed_; }
  /// Writes down who was boosted, `matches` being the final ones, or searched for in one pass.
  void note(int frame, Tracklets& active, std::span<const Match> matches,
            const FrameDetections& detections) const;

  /// Boxes embedded by the last call.
  std::size_t candidates() const { return candidates_.size(); }

 private:
  /// Samples of one size, with one_pass.
  struct View {
    mot::Tlwh box;  ///< around the prediction
    std::vector<image::GridShift> shifts;
  };

  void sample(const mot::Cxcywh& prediction, const image::ImageView& image);
  void embed(const image::ImageView& image, image::CropDescriptor& descriptor);
  void suppress(FrameDetections& detections, std::size_t first);

  const BoostingOptions& options_;
  const AppearanceOptions& appearance_;
  const ConfidenceOptions& confidence_;
  const SceneReport& scene_;
  std::vector<std::uint8_t> matched_;  // [active]
  bool changed_ = false;
  std::vector<std::size_t> searching_;        // indices into active
  std::vector<std::size_t> first_candidate_;  // [searching + 1]
  std::vector<mot::Tlwh> candidates_;
  std::vector<View> views_;         // their samples are the candidates, in order
  std::vector<image::Crop> crops_;  // [candidates]
  image::DescriptorRows rows_;      // [candidates]
  image::DescriptorRows part_;      // of a view
  std::vector<double> affinities_;  // of the boosted boxes
  mot::OverlapFinder overlaps_;
  std::vector<double> ranks_;
  std::vector<std::uint8_t> keep_;
};

}  // namespace sdmt::track
