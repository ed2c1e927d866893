// SPDX-License-Identifier: Apache-2.0
#include "track_history.h"

#include <algorithm>
#include <stdexcept>

#include "camera_warp.h"

namespace sdmt::track {

namespace {

KalmanFilter::Noise smoother_noise(const OutputOptions& options, const MotionOptions& motion) {
  KalmanFilter::Noise noise;
  noise.measurement = motion.position_noise;
  noise.position = options.smoothing_position_noise;
  noise.velocity = options.smoothing_velocity_noise;
  // The first box is as good as any other; nothing is known about the velocity.
  noise.initial_position = motion.position_noise;
  noise.initial_velocity = 0.25;
  return noise;
}

mot::Cxcywh between(const mot::Cxcywh& a, const mot::Cxcywh& b, double t) {
  return {a.cx + t * (b.cx - a.cx), a.cy + t * (b.cy - a.cy), a.width + t * (b.width - a.width),
          a.height + t * (b.height - a.height)};
}

}  // namespace

OutputRules::OutputRules(const OutputOptions& options, const MotionOptions& motion, int lag)
    : report(options.report),
      fill(options.fill),
      max_fill(options.max_fill),
      score_noise(motion.score_noise),
      smoother(smoother_noise(options, motion)),
      smoothing_block(std::max(1, lag / 8)) {
  if (options.amodal == OutputOptions::kInputSize) {
    throw std::invalid_argument(
        "amodal is auto, expected off or the picture's size, as 1920x1080: a tracker does not know "
        "its input");
  }
}

void TrackHistory::append(int frame, const mot::Cxcywh& measured, const mot::Cxcywh& filtered,
                          double score, BoxSource source) {
  Entry entry{frame, source, false, score, measured, filtered, {}, {}, {}};
  if (entries_.empty()) {
    entry.forward = rules_->smoother.start(measured);
  } else {
    Entry& last = entries_.back();
    last.gain = rules_->smoother.smoother_gain(last.forward, frame - last.frame);
    entry.forward =
        rules_->smoother.update(rules_->smoother.predict(last.forward, frame - last.frame),
                                measured, rules_->looseness(score));
  }
  entries_.push_back(entry);
}

void TrackHistory::prepend(const TrackHistory& older) {
  std::vector<Entry> newer;
  newer.swap(entries_);
  const std::size_t start = first_;
  first_ = 0;
  entries_.assign(older.entries_.begin() + static_cast<std::ptrdiff_t>(older.first_),
                  older.entries_.end());
  const std::size_t seam = entries_.size();
  for (std::size_t i = start; i < newer.size(); ++i) {
    const Entry& entry = newer[i];
    append(entry.frame, entry.measured, entry.filtered, entry.score, entry.source);
    entries_.back().merged = entry.merged;
  }
  if (seam > 0 && seam < entries_.size()) entries_[seam].merged = true;
}

std::optional<TrackedBox> TrackHistory::at(int frame) {
  const auto begin = entries_.begin() + static_cast<std::ptrdiff_t>(first_);
  const auto after = std::find_if(begin, entries_.end(),
                                  [frame](const Entry& entry) { return entry.frame > frame; });
  if (after == begin) return std::nullopt;
  const auto index = static_cast<std::size_t>(after - entries_.begin()) - 1;
  const Entry& entry = entries_[index];
  if (entry.frame == frame) {
    TrackedBox box{0, {}, entry.source == BoxSource::detected ? entry.score : 0.0, entry.source};
    switch (rules_->report) {
      case ReportBox::smoothed:
        box.box = mot::to_tlwh(smoothed(index).box());
        break;
      case ReportBox::filtered:
        box.box = mot::to_tlwh(entry.filtered);
        break;
      case ReportBox::detection:
        box.box = mot::to_tlwh(entry.measured);
        break;
    }
    return box;
  }
  if (after == entries_.end() || rules_->fill == FillGaps::none) return std::nullopt;
  if (rules_->fill == FillGaps::merged && !after->merged) return std::nullopt;
  if (after->frame - entry.frame - 1 > rules_->max_fill) return std::nullopt;
  return interpolated(index, frame);
}

TrackedBox TrackHistory::interpolated(std::size_t before, int frame) {
  const Entry& a = entries_[before];
  const Entry& b = entries_[before + 1];
  const double t = static_cast<double>(frame - a.frame) / (b.frame - a.frame);
  mot::Cxcywh box;
  switch (rules_->report) {
    case ReportBox::smoothed: {
      const KalmanState hidden = rules_->smoother.predict(a.forward, frame - a.frame);
      const int rest = b.frame - frame;
      box = smooth(hidden, rest, rules_->smoother.smoother_gain(hidden, rest), smoothed(before + 1))
                .box();
      box.width = std::max(box.width, KalmanFilter::kMinimumSize);
      box.height = std::max(box.height, KalmanFilter::kMinimumSize);
      break;
    }
    case ReportBox::filtered:
      box = between(a.filtered, b.filtered, t);
      break;
    case ReportBox::detection:
      box = between(a.measured, b.measured, t);
      break;
  }
  return {0, mot::to_tlwh(box), 0.0, BoxSource::interpolated};
}

// Calls visit(entry, smoothed state) from the last entry back to `entry`.
template <typename Visit>
void TrackHistory::smooth_back_to(std::size_t entry, Visit visit) const {
  KalmanState state = entries_.back().forward;
  visit(entries_.size() - 1, state);
  for (std::size_t i = entries_.size() - 1; i > entry; --i) {
    const Entry& before = entries_[i - 1];
    state = smooth(before.forward, entries_[i].frame - before.frame, before.gain, state);
    visit(i - 1, state);
  }
}

const KalmanState& TrackHistory::smoothed(std::size_t entry) {
  if (entries_[entry].smoothed) return *entries_[entry].smoothed;
  smooth_back_to(entry, [&](std::size_t i, KalmanState state) {
    if (entries_[i].frame >= entries_[entry].frame + rules_->smoothing_block) return;
    // Smoothing is linear and knows nothing of sizes: keep them above zero.
    state.mean[2] = std::max(state.mean[2], KalmanFilter::kMinimumSize);
    state.mean[3] = std::max(state.mean[3], KalmanFilter::kMinimumSize);
    entries_[i].smoothed = state;
  });
  return *entries_[entry].smoothed;
}

KalmanState TrackHistory::start() const {
  KalmanState start;
  smooth_back_to(first_, [&](std::size_t, const KalmanState& state) { start = state; });
  return start;
}

void TrackHistory::warp(const image::CameraMotion& motion) {
  for (std::size_t i = first_; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    entry.measured = warped(entry.measured, motion);
    entry.filtered = warped(entry.filtered, motion);
    entry.forward = warped(entry.forward, motion);
    if (entry.smoothed) entry.smoothed = warped(*entry.smoothed, motion);
  }
}

void TrackHistory::forget(int frame) {
  while (first_ + 1 < entries_.size() && entries_[first_ + 1].frame <= frame) ++first_;
  if (first_ > 32 && 2 * first_ > entries_.size()) drop_forgotten();
}

void TrackHistory::drop_forgotten() {
  entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(first_));
  first_ = 0;
}

}  // namespace sdmt::track
