// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detection_assignment.h"
#include "frame_detections.h"
#include "sdmt/image/image_view.h"
#include "sdmt/mot/overlaps.h"
#include "sdmt/track/appearance_model.h"
#include "sdmt/track/tracker_options.h"
#include "tracklet.h"

namespace sdmt::track {

/// Detection boosting (section III-F): looks for people whom the detector missed. Around the
/// prediction of each positive tracklet without a detection, boosted less than every boost_interval
/// frames, boxes are sampled densely: boost_grid x boost_grid shifts of up to boost_reach widths
/// and heights, in one size or three. They are clipped to the image and all embedded in one batch;
/// with boost_one_pass those inside the image are embedded by AppearanceModel::embed_shifted(),
/// size by size, and those that leave it are left out. The one closest in appearance joins the
/// detections when its affinity is above tau_a by more
/// than boost_margin.
class DetectionBoosting {
 public:
  DetectionBoosting(const TrackerOptions& options, double tau_a)
      : options_(options), tau_a_(tau_a) {}

  /// Appends the boosted boxes to `detections`, if any, and then marks those dropped that overlap a
  /// better one by more than boost_nms: real ones by score, after them the boosted ones by
  /// affinity. Returns how many boosted boxes are left. `matches` are those of the first
  /// assignment.
  int boost(int frame, const image::ImageView& image, AppearanceModel& appearance,
            const Tracklets& active, std::span<const Match> matches, FrameDetections& detections);

  /// Boxes embedded by the last call.
  std::size_t candidates() const { return candidates_.size(); }

 private:
  /// Samples of one size, with boost_one_pass.
  struct View {
    mot::Tlwh box;  ///< around the prediction
    std::vector<BoxShift> shifts;
  };

  void sample(const mot::Cxcywh& prediction, const image::ImageView& image);
  void embed(const image::ImageView& image, AppearanceModel& appearance);
  void suppress(FrameDetections& detections, std::size_t first);

  const TrackerOptions& options_;
  double tau_a_;
  std::vector<std::uint8_t> matched_;  // [active]
  std::vector<const Tracklet*> searching_;
  std::vector<std::size_t> first_candidate_;  // [searching + 1]
  std::vector<mot::Tlwh> candidates_;
  std::vector<View> views_;         // their samples are the candidates, in order
  Embeddings embeddings_;           // [candidates]
  Embeddings part_;                 // of a view
  std::vector<double> affinities_;  // of the boosted boxes
  mot::OverlapFinder overlaps_;
  std::vector<double> ranks_;
  std::vector<std::uint8_t> keep_;
};

}  // namespace sdmt::track
