// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace sdmt::track {

namespace {

void require(bool holds, const char* field, double value, const char* bound) {
  if (holds) return;
  std::ostringstream message;
  message << field << " is " << value << ", expected " << bound;
  throw std::invalid_argument(message.str());
}

void require_share(const char* field, double value) {
  require(value >= 0 && value <= 1, field, value, "0..1");
}

// A gate that nothing can pass, or that divides by zero when affinities are rescaled, is an error.
void require_gate(const char* field, double value) {
  require(value >= 0 && value < 1, field, value, ">= 0 and < 1");
}

void require_noise(const char* field, double value) {
  require(value > 0 && value <= 100, field, value, "> 0 and <= 100");
}

void require_number(const char* field, double value) {
  require(!std::isnan(value), field, value, "a number");
}

void require_frames(const char* field, int value, int least) {
  constexpr int kMost = 1'000'000;
  require(value >= least && value <= kMost, field, value, least == 0 ? "0..1000000" : "1..1000000");
}

}  // namespace

TrackerOptions TrackerOptions::paper() {
  TrackerOptions options;
  options.nms = 1;
  options.strong_confidence = -std::numeric_limits<double>::infinity();
  options.velocity_noise = 1.0 / 160;
  options.max_misses = 2;
  options.threshold_margin = 0;
  options.gallery_distance = GalleryDistance::mean;
  options.rescale_affinity = false;
  options.min_mean_confidence = 0.2;
  options.motion_association = false;
  options.association_reach = 0;
  options.boost_margin = 0;
  options.boost_scale_step = 0.1;
  options.boost_one_pass = false;
  options.max_fill = options.max_misses + options.association_horizon;
  options.report = ReportBox::filtered;
  return options;
}

int TrackerOptions::auto_delay() const {
  const int confirmation = (min_length - 1) * max_misses;
  const int gap = fill == FillGaps::none ? 0 : max_fill;
  return association ? gap + confirmation + association_interval
                     : std::min(gap, max_misses) + confirmation;
}

int TrackerOptions::decision_lag() const {
  return delay == kAutoDelay ? auto_delay() : std::min(delay, auto_delay());
}

void TrackerOptions::validate() const {
  if (calibration) calibration->validate();
  require_number("min_confidence", min_confidence);
  require_share("nms", nms);
  require_number("strong_confidence", strong_confidence);
  require_gate("weak_iou", weak_iou);
  require_noise("position_noise", position_noise);
  require_noise("velocity_noise", velocity_noise);
  require_gate("min_iou", min_iou);
  require_frames("max_misses", max_misses, 1);
  require_frames("association_horizon", association_horizon, 0);
  if (appearance_threshold) {
    require(*appearance_threshold >= -1 && *appearance_threshold < 1, "appearance_threshold",
            *appearance_threshold, ">= -1 and < 1");
  }
  require(threshold_margin >= -1 && threshold_margin <= 1, "threshold_margin", threshold_margin,
          "-1..1");
  require_share("lambda", lambda);
  require(gallery_size >= 1 && gallery_size <= 1000, "gallery_size", gallery_size, "1..1000");
  require_number("feature_min_confidence", feature_min_confidence);
  require_frames("embed_refresh", embed_refresh, 1);
  require_frames("min_length", min_length, 1);
  require_number("min_mean_confidence", min_mean_confidence);
  require_number("max_mean_cost", max_mean_cost);
  require(boost_grid >= 1 && boost_grid <= 31 && boost_grid % 2 == 1, "boost_grid", boost_grid,
          "an odd number in 1..31");
  require(boost_reach >= 0 && boost_reach <= 2, "boost_reach", boost_reach, "0..2");
  require(boost_margin >= 0 && boost_margin <= 1, "boost_margin", boost_margin, "0..1");
  require(boost_scale_step >= 0 && boost_scale_step <= 0.9, "boost_scale_step", boost_scale_step,
          "0..0.9");
  require_frames("boost_interval", boost_interval, 1);
  require_share("boost_nms", boost_nms);
  require_frames("association_interval", association_interval, 1);
  if (association_threshold) {
    require(*association_threshold >= -1 && *association_threshold < 1, "association_threshold",
            *association_threshold, ">= -1 and < 1");
  }
  require(association_reach >= 0 && association_reach <= 100, "association_reach",
          association_reach, "0..100");
  require_frames("max_fill", max_fill, 1);
  require_noise("smoothing_position_noise", smoothing_position_noise);
  require_noise("smoothing_velocity_noise", smoothing_velocity_noise);
  require(delay >= kAutoDelay, "delay", delay, ">= 0");
}

int parse_delay(std::string_view text) {
  if (text == "auto") return TrackerOptions::kAutoDelay;
  if (text == "inf") return TrackerOptions::kUnlimitedDelay;
  int frames = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frames);
  if (error != std::errc() || end != text.data() + text.size() || frames < 0) {
    throw std::invalid_argument("delay is '" + std::string(text) +
                                "', expected auto, inf or a number of frames >= 0");
  }
  return frames;
}

}  // namespace sdmt::track
