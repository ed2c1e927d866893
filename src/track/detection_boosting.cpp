// SPDX-License-Identifier: Apache-2.0
#include "detection_boosting.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace sdmt::track {

int DetectionBoosting::boost(int frame, const nn::ImageView& image, AppearanceModel& appearance,
                             const Tracklets& active, std::span<const Match> matches,
                             FrameDetections& detections) {
  searching_.clear();
  candidates_.clear();
  views_.clear();
  separate_.clear();
  first_candidate_.assign(1, 0);
  matched_.assign(active.size(), 0);
  for (const Match& match : matches) matched_[static_cast<std::size_t>(match.tracklet)] = 1;
  for (std::size_t i = 0; i < active.size(); ++i) {
    Tracklet& tracklet = *active[i];
    if (matched_[i] || tracklet.gallery.empty() || !tracklet.confidence.positive(options_) ||
        frame - tracklet.boosted_frame < options_.boost_interval) {
      continue;
    }
    sample(tracklet.state.box(), image);
    if (options_.boost_one_pass) tracklet.boosted_frame = frame;
    searching_.push_back(&tracklet);
    first_candidate_.push_back(candidates_.size());
  }
  if (candidates_.empty()) return 0;
  embed(image, appearance);

  const std::size_t first = detections.size();
  affinities_.clear();
  for (std::size_t i = 0; i < searching_.size(); ++i) {
    double best = threshold_;
    std::size_t chosen = candidates_.size();
    for (std::size_t j = first_candidate_[i]; j < first_candidate_[i + 1]; ++j) {
      if (!embeddings_.valid[j]) continue;
      const double affinity =
          1 - searching_[i]->gallery.distance(embeddings_.row(j), options_.gallery_distance);
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
    detections.set_feature(detections.size() - 1, embeddings_.row(chosen));
    affinities_.push_back(best);
  }
  if (detections.size() > first) suppress(detections, first);
  return static_cast<int>(std::count_if(
      detections.flags.begin() + static_cast<std::ptrdiff_t>(first), detections.flags.end(),
      [](const FrameDetections::Flags& flags) { return !flags.dropped; }));
}

void DetectionBoosting::sample(const Cxcywh& prediction, const nn::ImageView& image) {
  const int half = options_.boost_grid / 2;
  const double step = half > 0 ? options_.boost_reach / half : 0;
  const int sizes = options_.boost_scale_step > 0 ? 1 : 0;
  // Coordinates count the first pixel as 1: it covers [1, 2).
  const double right_end = image.width + 1.0, bottom_end = image.height + 1.0;
  for (int size = -sizes; size <= sizes; ++size) {
    const double scale = 1 + size * options_.boost_scale_step;
    const Tlwh middle = to_tlwh(
        {prediction.cx, prediction.cy, prediction.width * scale, prediction.height * scale});
    View view{middle, {}, {}};
    for (int y = -half; y <= half; ++y) {
      for (int x = -half; x <= half; ++x) {
        const BoxShift shift{static_cast<int>(std::lround(x * step / scale * BoxShift::kColumns)),
                             static_cast<int>(std::lround(y * step / scale * BoxShift::kRows))};
        const Tlwh box = options_.boost_one_pass ? shift.applied_to(middle)
                                                 : Tlwh{middle.left + x * step * prediction.width,
                                                        middle.top + y * step * prediction.height,
                                                        middle.width, middle.height};
        const double left = std::max(box.left, 1.0), top = std::max(box.top, 1.0);
        const double right = std::min(box.left + box.width, right_end);
        const double bottom = std::min(box.top + box.height, bottom_end);
        if (right - left <= 0 || bottom - top <= 0) continue;
        const bool whole = left == box.left && top == box.top && right == box.left + box.width &&
                           bottom == box.top + box.height;
        if (options_.boost_one_pass && whole) {
          view.shifts.push_back(shift);
          view.candidates.push_back(candidates_.size());
        } else {
          separate_.push_back(candidates_.size());
        }
        candidates_.push_back({left, top, right - left, bottom - top});
      }
    }
    if (!view.shifts.empty()) views_.push_back(std::move(view));
  }
}

void DetectionBoosting::embed(const nn::ImageView& image, AppearanceModel& appearance) {
  const auto dimension = static_cast<std::size_t>(appearance.dimension());
  embeddings_.dimension = appearance.dimension();
  embeddings_.values.resize(candidates_.size() * dimension);
  embeddings_.valid.resize(candidates_.size());
  separate_boxes_.clear();
  for (const std::size_t i : separate_) separate_boxes_.push_back(candidates_[i]);
  if (!separate_.empty()) {
    appearance.embed(image, separate_boxes_, part_);
    keep_rows(separate_);
  }
  for (const View& view : views_) {
    appearance.embed_shifted(image, view.box, view.shifts, part_);
    keep_rows(view.candidates);
  }
}

// Row i of part_ is that of candidates[i].
void DetectionBoosting::keep_rows(const std::vector<std::size_t>& candidates) {
  const auto dimension = static_cast<std::size_t>(embeddings_.dimension);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    embeddings_.valid[candidates[i]] = part_.valid[i];
    std::copy_n(
        part_.row(i).begin(), dimension,
        embeddings_.values.begin() + static_cast<std::ptrdiff_t>(candidates[i] * dimension));
  }
}

// Boosted boxes come after the real ones, in order of their affinity (-1..1).
void DetectionBoosting::suppress(FrameDetections& detections, std::size_t first) {
  double lowest = 0;
  for (std::size_t i = 0; i < first; ++i) lowest = std::min(lowest, detections.scores[i]);
  ranks_.assign(detections.scores.begin(),
                detections.scores.begin() + static_cast<std::ptrdiff_t>(first));
  for (const double affinity : affinities_) ranks_.push_back(lowest - 2 + affinity);
  suppress_overlaps(detections.boxes, ranks_, options_.boost_nms, overlaps_, keep_);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (!keep_[i]) detections.flags[i].dropped = true;
  }
}

}  // namespace sdmt::track
