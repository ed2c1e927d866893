// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "camera_warp.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/stopwatch.h"
#include "sdmt/track/pixel_rect.h"
#include "tracker_state.h"

namespace sdmt::track {

namespace {

const TrackerOptions& valid(const TrackerOptions& options) {
  options.validate();
  return options;
}

KalmanFilter::Noise tracking_noise(const MotionOptions& options) {
  return {options.position_noise, options.position_noise, options.velocity_noise,
          2 * options.position_noise, 10 * options.velocity_noise};
}

image::CameraMotion checked(const std::optional<image::CameraMotion>& camera) {
  if (!camera) return {};
  constexpr double kMost = 1e6;
  io::require_in("camera motion: tx", camera->tx, -kMost, kMost);
  io::require_in("camera motion: ty", camera->ty, -kMost, kMost);
  io::require_in("camera motion: zoom", camera->scale(), 0.1, 10.0);
  return *camera;
}

double chosen_tau_a(const AppearanceOptions& options, const image::CropDescriptor* descriptor) {
  if (options.tau_a) return *options.tau_a;
  if (descriptor == nullptr) return 0.0;
  const auto tau_a = descriptor->tau_a();
  if (!tau_a) {
    throw std::invalid_argument("the descriptor '" + descriptor->name() +
                                "' has no tau_a, expected AppearanceOptions::tau_a");
  }
  return *tau_a - options.tau_a_margin;
}

}  // namespace

Tracker::State::State(const TrackerOptions& given, image::CropDescriptor* model)
    : options(valid(given)),
      descriptor(model),
      tau_a(chosen_tau_a(options.appearance, model)),
      motion(tracking_noise(options.motion)),
      scene(options.scene, options.appearance, options.confidence, tau_a),
      assignment(options.assignment, options.appearance, scene.report()),
      selection(options.appearance, options.confidence),
      boosting(options.boosting, options.appearance, options.confidence, scene.report()),
      association(options.association, options.motion, options.appearance, model != nullptr,
                  scene.report()),
      output(options.output, options.motion, options.confidence, options.decision_lag()),
      unclaimed(options, motion, output.rules()),
      clock(options.input.frame_rate, options.memory_frames()) {}

Tracker::Tracker(const TrackerOptions& options, image::CropDescriptor* descriptor)
    : state_(std::make_unique<State>(options, descriptor)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

const std::vector<FinishedFrame>& Tracker::update(std::span<const mot::Detection> detections,
                                                  const FrameContext& frame) {
  state_->require_open();
  const int frames = state_->clock.frames_until(frame.time, state_->frame);
  const image::CameraMotion camera = checked(frame.camera);
  state_->accept(detections);
  state_->pass(frames - 1);
  state_->predict(camera);
  try {
    state_->embed(frame.image);
    state_->assign();
    state_->boost(frame.image);
  } catch (...) {
    state_->take_back();
    throw;
  }
  state_->warp_but_active(camera);
  state_->update_tracklets();
  return state_->complete(frame.time);
}

const std::vector<FinishedFrame>& Tracker::skip(const FrameContext& frame) {
  state_->require_open();
  const int frames = state_->clock.frames_until(frame.time, state_->frame);
  const image::CameraMotion camera = checked(frame.camera);
  state_->pass(frames - 1);
  state_->predict(camera);
  state_->warp_but_active(camera);
  state_->retire();
  return state_->complete(frame.time);
}

const std::vector<FinishedFrame>& Tracker::finish() {
  state_->require_open();
  state_->ended = true;
  state_->associate();
  state_->emit(true);
  state_->end_all();
  return state_->output.finished();
}

const TrackerStats& Tracker::stats() const { return state_->stats; }

const SceneReport& Tracker::scene() const { return state_->scene.report(); }

const AppearanceGallery* Tracker::gallery(int id) const {
  for (const Tracklets* group : {&state_->active, &state_->idle}) {
    for (const auto& tracklet : *group) {
      if (tracklet->id == id) return &tracklet->gallery;
    }
  }
  return nullptr;
}

void Tracker::on_track_ended(std::function<void(const EndedTrack&)> observer) {
  state_->track_ended = std::move(observer);
}

void Tracker::on_association(std::function<void(const AssociationDecision&)> observer) {
  state_->association.observer = std::move(observer);
}

void Tracker::on_dropped(std::function<void(const DroppedTracklet&)> observer) {
  state_->tracklet_dropped = std::move(observer);
}

void Tracker::State::accept(std::span<const mot::Detection> given) {
  const io::Stopwatch watch(stats.predict_seconds);
  filter.accept(given, options.input, detections);
  stats_before = stats;
  stats.detections += static_cast<std::int64_t>(given.size());
  stats.suppressed += static_cast<std::int64_t>(given.size() - detections.size());
}

// Frames go by that no detector looks at.
void Tracker::State::pass(int frames) {
  if (frames == 0) return;
  const io::Stopwatch watch(stats.predict_seconds);
  frame += frames;
  for (const auto& tracklet : active) {
    tracklet->state = motion.predict(tracklet->state, frames);
    tracklet->state_frame = frame;
  }
  retire();
}

void Tracker::State::predict(const image::CameraMotion& camera) {
  const io::Stopwatch watch(stats.predict_seconds);
  ++frame;
  states_before.clear();
  for (const auto& tracklet : active) {
    states_before.push_back(tracklet->state);
    tracklet->state = motion.predict(tracklet->state);
    if (!camera.is_still()) tracklet->state = warped(tracklet->state, camera);
    tracklet->state_frame = frame;
  }
}

// The rest of what moves with the picture; the states of active tracklets did when predicted.
void Tracker::State::warp_but_active(const image::CameraMotion& camera) {
  if (camera.is_still()) return;
  for (Tracklets* group : {&active, &idle}) {
    for (const auto& tracklet : *group) {
      tracklet->first_box = warped(tracklet->first_box, camera);
      tracklet->history.warp(camera);
      if (group == &idle) tracklet->state = warped(tracklet->state, camera);
    }
  }
  unclaimed.warp(camera);
  output.warp(camera);
}

// Until here nothing but the frame's number, the counts and the predictions has changed.
void Tracker::State::take_back() {
  --frame;
  stats = stats_before;
  for (std::size_t i = 0; i < active.size(); ++i) {
    active[i]->state = states_before[i];
    active[i]->state_frame = frame;
  }
}

void Tracker::State::embed(const image::ImageView* image) {
  {
    const io::Stopwatch watch(stats.assign_seconds);
    assignment.gate(active, detections, frame - looked - 1);
    if (descriptor == nullptr) return;
    clear.find(assignment.gated(), active.size(), detections.size(), options.assignment.min_iou);
  }
  if (image == nullptr || image->empty()) return;
  const io::Stopwatch watch(stats.embed_seconds);
  // In every embed_refresh-th frame, or the first one after it that is looked at.
  const int refresh = options.appearance.embed_refresh;
  const bool everybody = frame / refresh != looked / refresh;
  const auto& chosen = selection.choose(frame, everybody, active, detections, clear);
  if (chosen.empty()) return;
  crops.clear();
  for (const std::size_t i : chosen) crops.push_back({*image, to_pixel_rect(detections.boxes[i])});
  descriptor->describe(crops, rows);
  if (dimension != 0)
    io::require_in("the descriptor's dimension", rows.dimension, dimension, dimension);
  dimension = rows.dimension;
  stats.embedded += static_cast<std::int64_t>(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (rows.valid[i]) {
      detections.set_feature(chosen[i], rows.row(i));
    } else {
      ++stats.without_embedding;
    }
  }
}

void Tracker::State::assign() {
  const io::Stopwatch watch(stats.assign_seconds);
  matches = assignment.assign(active, detections);
}

void Tracker::State::boost(const image::ImageView* image) {
  if (!options.boosting.enabled || descriptor == nullptr || image == nullptr || image->empty())
    return;
  const io::Stopwatch watch(stats.boost_seconds);
  boosting.boost(frame, *image, *descriptor, active, matches, detections);
  stats.embedded += static_cast<std::int64_t>(boosting.candidates());
  if (boosting.changed()) {
    // The whole frame again, from the same predictions: a boosted box may free a detection.
    assignment.gate(active, detections, frame - looked - 1);
    matches = assignment.assign(active, detections);
  }
  boosting.note(frame, active, matches, detections);
}

void Tracker::State::update_tracklets() {
  const io::Stopwatch watch(stats.assign_seconds);
  for (const auto& tracklet : active) ++tracklet->misses;
  evidence = std::min(frame - looked, std::max(1, options.confidence.min_length / 2));
  if (descriptor != nullptr) scene.learn(frame, active, detections, clear);
  std::vector<bool> taken(detections.size(), false);
  for (const Match& match : matches) {
    Tracklet& tracklet = *active[match.tracklet];
    const int detection = match.detection;
    taken[detection] = true;
    const mot::Cxcywh box = mot::to_cxcywh(detections.boxes[detection]);
    const double score = detections.scores[detection];
    tracklet.state = motion.update(tracklet.state, box, output.rules().looseness(score));
    tracklet.misses = 0;
    tracklet.last_frame = frame;
    const auto& flags = detections.flags[detection];
    if (flags.boosted) {
      ++stats.boosted;
    } else {
      tracklet.confidence.add(score, evidence);
      scene.give(tracklet, score);
      tracklet.shape.see(detections.boxes[detection], options.output.amodal);
      store_appearance(tracklet, detection);
    }
    tracklet.history.append(frame, box, tracklet.state.box(), score,
                            flags.boosted ? BoxSource::boosted : BoxSource::detected);
  }
  retire();
  looked = frame;
  unclaimed.begin_frame(frame);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const auto& flags = detections.flags[i];
    if (taken[i] || flags.boosted || flags.dropped) continue;
    if (flags.strong) {
      start_tracklet(i);
    } else {
      unclaimed.add(detections.boxes[i], detections.scores[i]);
      scene.leave(detections.scores[i]);
    }
  }
  look_back();
}

void Tracker::State::look_back() {
  if (options.motion.look_back == 0) return;
  for (const auto& tracklet : active) {
    if (tracklet->looked_back || !tracklet->confidence.positive(options.confidence)) continue;
    tracklet->looked_back = true;
    const auto before = unclaimed.claim(tracklet->history.start(), tracklet->history.start_frame(),
                                        output.decided());
    if (before) tracklet->begin_with(*before);
  }
}

void Tracker::State::start_tracklet(std::size_t detection) {
  auto tracklet =
      std::make_unique<Tracklet>(++last_id, frame, options.appearance.gallery_size, output.rules());
  const mot::Cxcywh box = mot::to_cxcywh(detections.boxes[detection]);
  const double score = detections.scores[detection];
  tracklet->first_box = box;
  tracklet->state = motion.start(box);
  tracklet->confidence.add(score, evidence);
  scene.give(*tracklet, score);
  tracklet->shape.see(detections.boxes[detection], options.output.amodal);
  store_appearance(*tracklet, detection);
  tracklet->history.append(frame, box, box, score, BoxSource::detected);
  active.push_back(std::move(tracklet));
  ++stats.tracklets;
}

void Tracker::State::store_appearance(Tracklet& tracklet, std::size_t detection) {
  if (!detections.flags[detection].embedded) return;
  tracklet.gallery.add(detections.feature(detection));
  tracklet.feature_frame = frame;
}

const std::vector<FinishedFrame>& Tracker::State::complete(std::optional<double> time) {
  clock.set(time, frame);
  output.add(frame);
  ++stats.frames;
  // At every multiple of the interval, or as soon as one has passed.
  const int period = frame / options.association.interval;
  if (period != associated) associate();
  associated = period;
  emit(false);
  return output.finished();
}

void Tracker::State::emit(bool at_end) {
  const io::Stopwatch watch(stats.emit_seconds);
  output.emit(frame, at_end, active, idle, stats.tracks);
}

}  // namespace sdmt::track
