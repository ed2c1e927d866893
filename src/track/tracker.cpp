// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "detection_assignment.h"
#include "detection_boosting.h"
#include "embedding_selection.h"
#include "frame_detections.h"
#include "track_history.h"
#include "track_output.h"
#include "tracklet.h"
#include "tracklet_association.h"

namespace sdmt::track {

namespace {

/// Adds the life time of the object to a sum of seconds.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

const TrackerOptions& valid(const TrackerOptions& options) {
  options.validate();
  return options;
}

KalmanFilter::Noise tracking_noise(const TrackerOptions& options) {
  return {options.position_noise, options.position_noise, options.velocity_noise,
          2 * options.position_noise, 10 * options.velocity_noise};
}

double assignment_threshold(const TrackerOptions& options, const AppearanceModel* appearance) {
  if (options.appearance_threshold) return *options.appearance_threshold;
  return appearance == nullptr ? 0.0 : appearance->affinity_threshold() - options.threshold_margin;
}

}  // namespace

struct Tracker::State {
  State(const TrackerOptions& given, AppearanceModel* model)
      : options(valid(given)),
        appearance(model),
        motion(tracking_noise(options)),
        assignment(options, assignment_threshold(options, model)),
        boosting(options, assignment_threshold(options, model)),
        association(options, model != nullptr,
                    options.association_threshold.value_or(assignment_threshold(options, model))),
        output(options) {}

  void require_open() const {
    if (ended) throw std::logic_error("Tracker: finish() was called, nothing can follow it");
  }
  void accept(std::span<const mot::Detection> given);
  void predict();
  void embed(const image::ImageView* image);
  void assign();
  void boost(const image::ImageView* image);
  void update_tracklets();
  void associate();
  void emit(bool at_end);

  void start_tracklet(std::size_t detection);
  void store_appearance(Tracklet& tracklet, std::size_t detection);
  void retire();
  void merge(Tracklet& older, Tracklet& newer);

  const TrackerOptions options;
  AppearanceModel* const appearance;
  const KalmanFilter motion;
  DetectionFilter filter;
  DetectionAssignment assignment;
  EmbeddingSelection selection;
  DetectionBoosting boosting;
  TrackletAssociation association;
  TrackOutput output;

  bool ended = false;
  int frame = 0;
  int last_id = 0;
  Tracklets active;  // by id
  Tracklets idle;    // inactive ones that can still be associated or reported, by id
  FrameDetections detections;
  std::vector<Match> matches;
  std::vector<mot::Tlwh> boxes_to_embed;
  Embeddings embeddings;
  TrackerStats stats;
};

Tracker::Tracker(const TrackerOptions& options, AppearanceModel* appearance)
    : state_(std::make_unique<State>(options, appearance)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

const std::vector<FinishedFrame>& Tracker::update(std::span<const mot::Detection> detections,
                                                  const image::ImageView* frame) {
  state_->require_open();
  state_->accept(detections);
  state_->predict();
  state_->embed(frame);
  state_->assign();
  state_->boost(frame);
  state_->update_tracklets();
  if (state_->frame % state_->options.association_interval == 0) state_->associate();
  state_->emit(false);
  return state_->output.finished();
}

const std::vector<FinishedFrame>& Tracker::finish() {
  state_->require_open();
  state_->ended = true;
  state_->associate();
  state_->emit(true);
  return state_->output.finished();
}

const TrackerStats& Tracker::stats() const { return state_->stats; }

void Tracker::on_association(std::function<void(const AssociationDecision&)> observer) {
  state_->association.observer = std::move(observer);
}

void Tracker::State::accept(std::span<const mot::Detection> given) {
  const Stopwatch watch(stats.predict_seconds);
  filter.accept(given, options, detections);
  ++frame;
  ++stats.frames;
  stats.detections += static_cast<std::int64_t>(given.size());
  stats.suppressed += static_cast<std::int64_t>(given.size() - detections.size());
}

void Tracker::State::predict() {
  const Stopwatch watch(stats.predict_seconds);
  for (const auto& tracklet : active) {
    tracklet->state = motion.predict(tracklet->state);
    tracklet->state_frame = frame;
  }
}

void Tracker::State::embed(const image::ImageView* image) {
  {
    const Stopwatch watch(stats.assign_seconds);
    assignment.gate(active, detections);
  }
  if (appearance == nullptr || image == nullptr || image->empty()) return;
  const Stopwatch watch(stats.embed_seconds);
  const auto& chosen = selection.choose(frame, options, active, detections, assignment.gated());
  if (chosen.empty()) return;
  boxes_to_embed.clear();
  for (const std::size_t i : chosen) boxes_to_embed.push_back(detections.boxes[i]);
  appearance->embed(*image, boxes_to_embed, embeddings);
  stats.embedded += static_cast<std::int64_t>(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (embeddings.valid[i]) {
      detections.set_feature(chosen[i], embeddings.row(i));
    } else {
      ++stats.without_embedding;
    }
  }
}

void Tracker::State::assign() {
  const Stopwatch watch(stats.assign_seconds);
  matches = assignment.assign(active, detections);
}

void Tracker::State::boost(const image::ImageView* image) {
  if (!options.boosting || appearance == nullptr || image == nullptr || image->empty()) return;
  const Stopwatch watch(stats.boost_seconds);
  const int added = boosting.boost(frame, *image, *appearance, active, matches, detections);
  stats.embedded += static_cast<std::int64_t>(boosting.candidates());
  if (added == 0) return;
  // The whole frame again, from the same predictions: a boosted box may free a detection.
  assignment.gate(active, detections);
  matches = assignment.assign(active, detections);
}

void Tracker::State::update_tracklets() {
  const Stopwatch watch(stats.assign_seconds);
  for (const auto& tracklet : active) ++tracklet->misses;
  std::vector<bool> taken(detections.size(), false);
  for (const Match& match : matches) {
    Tracklet& tracklet = *active[static_cast<std::size_t>(match.tracklet)];
    const auto detection = static_cast<std::size_t>(match.detection);
    taken[detection] = true;
    const mot::Cxcywh box = mot::to_cxcywh(detections.boxes[detection]);
    tracklet.state = motion.update(tracklet.state, box);
    tracklet.misses = 0;
    tracklet.last_frame = frame;
    const auto& flags = detections.flags[detection];
    const double score = detections.scores[detection];
    if (flags.boosted) {
      tracklet.boosted_frame = frame;
      ++stats.boosted;
    } else {
      tracklet.confidence.add(score, 1 - match.affinity);
      store_appearance(tracklet, detection);
    }
    tracklet.history.append(output.rules(), frame, box, tracklet.state.box(), score,
                            flags.boosted ? BoxSource::boosted : BoxSource::detected);
  }
  retire();
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const auto& flags = detections.flags[i];
    if (!taken[i] && flags.strong && !flags.boosted && !flags.dropped) start_tracklet(i);
  }
}

void Tracker::State::start_tracklet(std::size_t detection) {
  auto tracklet = std::make_unique<Tracklet>(++last_id, frame, options);
  const mot::Cxcywh box = mot::to_cxcywh(detections.boxes[detection]);
  const double score = detections.scores[detection];
  tracklet->first_box = box;
  tracklet->state = motion.start(box);
  tracklet->confidence.add(score, 0);
  store_appearance(*tracklet, detection);
  tracklet->history.append(output.rules(), frame, box, box, score, BoxSource::detected);
  active.push_back(std::move(tracklet));
  ++stats.tracklets;
}

void Tracker::State::store_appearance(Tracklet& tracklet, std::size_t detection) {
  if (!detections.flags[detection].embedded) return;
  if (detections.scores[detection] < options.feature_min_confidence) return;
  tracklet.gallery.add(detections.feature(detection));
  tracklet.feature_frame = frame;
}

// Moves tracklets that missed too often to the idle ones, and forgets those that nothing can come
// of: negative ones, which get no more detections, and old ones, behind which no tracklet can begin
// any more and be positive in time.
void Tracker::State::retire() {
  const int horizon = options.max_misses + options.association_horizon + options.auto_delay();
  std::erase_if(idle, [&](const auto& tracklet) { return frame - tracklet->last_frame > horizon; });
  bool sorted = true;
  for (auto& tracklet : active) {
    if (tracklet->misses < options.max_misses) continue;
    if (tracklet->reported || tracklet->confidence.positive(options)) {
      sorted = sorted && (idle.empty() || idle.back()->id < tracklet->id);
      idle.push_back(std::move(tracklet));
    } else {
      tracklet.reset();
    }
  }
  std::erase(active, nullptr);
  if (!sorted) {
    std::sort(idle.begin(), idle.end(), [](const auto& x, const auto& y) { return x->id < y->id; });
  }
}

void Tracker::State::associate() {
  if (!options.association || (appearance == nullptr && !options.motion_association)) return;
  const Stopwatch watch(stats.associate_seconds);
  std::vector<Tracklet*> positive;
  for (const Tracklets* group : {&idle, &active}) {
    for (const auto& tracklet : *group) {
      if (tracklet->confidence.positive(options)) positive.push_back(tracklet.get());
    }
  }
  const auto by_id = [](const auto& x, const auto& y) { return x->id < y->id; };
  std::sort(positive.begin(), positive.end(), by_id);
  const auto merges = stats.merges;
  association.run(frame, std::move(positive),
                  [this](Tracklet& older, Tracklet& newer) { merge(older, newer); });
  if (stats.merges == merges) return;
  std::sort(active.begin(), active.end(), by_id);
  std::sort(idle.begin(), idle.end(), by_id);
}

void Tracker::State::merge(Tracklet& older, Tracklet& newer) {
  ++stats.merges;
  output.merge(older, newer);
  newer.id = older.id;
  newer.first_frame = older.first_frame;
  newer.first_box = older.first_box;
  newer.confidence.add(older.confidence);
  newer.gallery.prepend(older.gallery);
  newer.reported = newer.reported || older.reported;
  for (Tracklets* group : {&idle, &active}) {
    std::erase_if(*group, [&older](const auto& tracklet) { return tracklet.get() == &older; });
  }
}

void Tracker::State::emit(bool at_end) {
  const Stopwatch watch(stats.emit_seconds);
  output.emit(frame, at_end, active, idle, stats.tracks);
}

}  // namespace sdmt::track
