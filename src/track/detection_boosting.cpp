// SPDX-License-Identifier: Apache-2.0
#include "detection_boosting.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "sdmt/track/pixel_rect.h"

namespace sdmt::track {

namespace {

// Coordinates count the first pixel as 1: it covers [1, 2).
bool inside(const mot::Tlwh& box, const image::ImageView& image) {
  return box.left >= 1 && box.top >= 1 && box.left + box.width <= image.width + 1 &&
         box.top + box.height <= image.height + 1;
}

// The part inside the image; without extent when there is none.
mot::Tlwh clip(const mot::Tlwh& box, const image::ImageView& image) {
  const double left = std::max(box.left, 1.0), top = std::max(box.top, 1.0);
  const double right = std::min(box.left + box.width, image.width + 1.0);
  const double bottom = std::min(box.top + box.height, image.height + 1.0);
  return {left, top, std::max(0.0, right - left), std::max(0.0, bottom - top)};
}

}  // namespace

int DetectionBoosting::boost(int frame, const image::ImageView& image,
                             image::CropDescriptor& descriptor, const Tracklets& active,
                             std::span<const Match> matches, FrameDetections& detections) {
  changed_ = false;
  searching_.clear();
  candidates_.clear();
  views_.clear();
  first_candidate_.assign(1, 0);
  matched_.assign(active.size(), 0);
  for (const Match& match : matches) matched_[match.tracklet] = 1;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const Tracklet& tracklet = *active[i];
    if (matched_[i] || tracklet.gallery.empty() || !tracklet.confidence.positive(confidence_) ||
        frame - tracklet.boosted_frame < options_.interval) {
      continue;
    }
    sample(tracklet.state.box(), image);
    searching_.push_back(i);
    first_candidate_.push_back(candidates_.size());
  }
  if (candidates_.empty()) return 0;
  embed(image, descriptor);

  const std::size_t first = detections.size();
  affinities_.clear();
  for (std::size_t i = 0; i < searching_.size(); ++i) {
    double best = scene_.assignment_threshold + options_.margin;
    std::size_t chosen = candidates_.size();
    for (std::size_t j = first_candidate_[i]; j < first_candidate_[i + 1]; ++j) {
      if (!rows_.valid[j]) continue;
      const double affinity =
          1 - active[searching_[i]]->gallery.distance(rows_.row(j), appearance_.gallery_distance);
      if (affinity > best) {
        best = affinity;
        chosen = j;
      }
    }
    if (chosen == candidates_.size()) continue;
    FrameDetections::Flags flags;
    flags.strong = true;
    flags.boosted = true;
    detections.add(candidates_[chosen], 0.0, flags);
    detections.set_feature(detections.size() - 1, rows_.row(chosen));
    affinities_.push_back(best);
  }
  if (detections.size() == first) return 0;
  suppress(detections, first);
  int left = 0;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const bool dropped = detections.flags[i].dropped;
    if (i >= first && !dropped) ++left;
    changed_ = changed_ || dropped == (i < first);
  }
  return left;
}

void DetectionBoosting::note(int frame, Tracklets& active, std::span<const Match> matches,
                             const FrameDetections& detections) const {
  if (options_.one_pass) {
    for (const std::size_t i : searching_) active[i]->boosted_frame = frame;
  }
  for (const Match& match : matches) {
    if (detections.flags[match.detection].boosted) active[match.tracklet]->boosted_frame = frame;
  }
}

void DetectionBoosting::sample(const mot::Cxcywh& prediction, const image::ImageView& image) {
  const int sizes = options_.scale_step > 0 ? 1 : 0;
  const int half = options_.grid / 2;
  const double step = half > 0 ? options_.reach / half : 0;
  for (int size = -sizes; size <= sizes; ++size) {
    const double scale = 1 + size * options_.scale_step;
    View view{mot::to_tlwh({prediction.cx, prediction.cy, prediction.width * scale,
                            prediction.height * scale}),
              {}};
    for (int y = -half; y <= half; ++y) {
      for (int x = -half; x <= half; ++x) {
        const double right = x * step / scale, down = y * step / scale;  // in the view's box
        if (options_.one_pass) {
          const image::GridShift shift{
              static_cast<int>(std::lround(right * image::GridShift::kColumns)),
              static_cast<int>(std::lround(down * image::GridShift::kRows))};
          const mot::Tlwh box = shift.applied_to(view.box);
          if (!inside(box, image)) continue;
          view.shifts.push_back(shift);
          candidates_.push_back(box);
        } else {
          const mot::Tlwh box =
              clip({view.box.left + right * view.box.width, view.box.top + down * view.box.height,
                    view.box.width, view.box.height},
                   image);
          if (area(box) > 0) candidates_.push_back(box);
        }
      }
    }
    if (!view.shifts.empty()) views_.push_back(std::move(view));
  }
}

void DetectionBoosting::embed(const image::ImageView& image, image::CropDescriptor& descriptor) {
  if (!options_.one_pass) {
    crops_.clear();
    for (const mot::Tlwh& box : candidates_) crops_.push_back({image, to_pixel_rect(box)});
    descriptor.describe(crops_, rows_);
    return;
  }
  rows_.reset(0, descriptor.dimension());
  for (const View& view : views_) {
    descriptor.describe_shifted(image, to_pixel_rect(view.box), view.shifts, part_);
    rows_.values.insert(rows_.values.end(), part_.values.begin(), part_.values.end());
    rows_.valid.insert(rows_.valid.end(), part_.valid.begin(), part_.valid.end());
  }
}

// Boosted boxes come after the real ones, in order of their affinity (-1..1).
void DetectionBoosting::suppress(FrameDetections& detections, std::size_t first) {
  double lowest = 0;
  for (std::size_t i = 0; i < first; ++i) lowest = std::min(lowest, detections.scores[i]);
  ranks_.assign(detections.scores.begin(),
                detections.scores.begin() + static_cast<std::ptrdiff_t>(first));
  for (const double affinity : affinities_) ranks_.push_back(lowest - 2 + affinity);
  mot::suppress_overlaps(detections.boxes, ranks_, options_.nms, overlaps_, keep_);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (!keep_[i]) detections.flags[i].dropped = true;
  }
}

}  // namespace sdmt::track
