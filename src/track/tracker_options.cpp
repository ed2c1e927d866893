// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker_options.h"

#include <algorithm>
#include <stdexcept>

#include "sdmt/track/tracker_option_table.h"

namespace sdmt::track {

double InputOptions::probability(double score) const {
  if (!use_scores) return 1;
  return calibration ? calibration->probability(score) : score;
}

TrackerOptions TrackerOptions::paper() {
  TrackerOptions options;
  options.input.nms = 1;
  options.input.strong_confidence = -std::numeric_limits<double>::infinity();
  options.motion.velocity_noise = 1.0 / 160;
  options.motion.max_misses = 2;
  options.motion.score_noise = 0;
  options.motion.look_back = 0;
  options.assignment.weak_iou = 0.3;
  options.assignment.rescale_affinity = false;
  options.appearance.tau_a_margin = 0;
  options.appearance.gallery_distance = GalleryDistance::mean;
  options.confidence.min_mean_confidence = 0.2;
  options.boosting.margin = 0;
  options.boosting.scale_step = 0.1;
  options.boosting.one_pass = false;
  options.association.by_motion = false;
  options.association.reach = 0;
  options.association.literal = true;
  options.output.max_fill = options.motion.max_misses + options.association.horizon;
  options.output.report = ReportBox::filtered;
  return options;
}

TrackerOptions TrackerOptions::online() {
  TrackerOptions options;
  options.motion.max_misses = 45;
  options.assignment.min_iou = 0.1;
  options.confidence.min_length = 2;
  options.association.enabled = false;
  options.output.report = ReportBox::filtered;
  options.output.delay = 0;
  return options;
}

int TrackerOptions::confirmation_frames() const {
  return (confidence.min_length - 1) * motion.max_misses;
}

int TrackerOptions::auto_delay() const {
  const int gap = output.fill == FillGaps::none ? 0 : output.max_fill;
  const int known = confirmation_frames() + motion.look_back;
  return association.enabled ? gap + known + association.interval
                             : std::min(gap, motion.max_misses) + known;
}

int TrackerOptions::memory_frames() const {
  return motion.max_misses + association.horizon + auto_delay() + 1;
}

int TrackerOptions::decision_lag() const {
  return output.delay == OutputOptions::kAutoDelay ? auto_delay()
                                                   : std::min(output.delay, auto_delay());
}

void TrackerOptions::fit_to_picture(const image::PictureSize& picture, const std::string& whose) {
  if (output.amodal != OutputOptions::kInputSize) return;
  if (picture.width < 1 || picture.height < 1) {
    throw std::invalid_argument(whose +
                                ": the size of its picture is not known, expected --amodal off or "
                                "WIDTHxHEIGHT");
  }
  output.amodal = picture;
}

void TrackerOptions::validate() const { tracker_option_table().validate(*this); }

}  // namespace sdmt::track
