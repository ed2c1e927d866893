// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sdmt/io/hash.h"
#include "sdmt/track/tracker_option_table.h"
#include "state_archive.h"
#include "tracker_state.h"

namespace sdmt::track {

namespace {

constexpr std::uint32_t kMagic = 0x544d4453;  // "SDMT"
constexpr int kLatest = 1 << 30;              // frames and ids
// Far beyond what boxes within mot::kFarthest lead to, and squares stay finite.
constexpr double kLargest = 1e20, kLargestVariance = 1e60;

// Over words of eight bytes: against what happens to files, not against forgers.
std::uint64_t checksum(std::span<const std::byte> bytes) {
  std::uint64_t sum = io::kEmptyHash;
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    const auto part = bytes.subspan(i, std::min(sizeof word, bytes.size() - i));
    std::copy(part.begin(), part.end(), reinterpret_cast<std::byte*>(&word));
    io::hash_word(sum, word);
  }
  return sum;
}

}  // namespace

/// What a snapshot holds of each part of a tracker: said once for writing and reading, with what
/// must be true of what is read. Who adds a field to one of these parts adds it here and raises
/// kVersion.
struct Snapshot {
  static constexpr std::uint32_t kVersion = 4;

  template <typename Archive>
  static void whole(Archive& archive, int& number, int low, int high) {
    archive.value(number);
    archive.check(number >= low && number <= high, "holds a number that cannot be");
  }
  template <typename Archive>
  static void real(Archive& archive, double& number) {
    archive.value(number);
    archive.check(std::abs(number) <= kLargest, "holds a number that cannot be");
  }
  // A detector's, or a sum of them: any finite number.
  template <typename Archive>
  static void score(Archive& archive, double& number) {
    archive.value(number);
    archive.check(std::isfinite(number), "holds a number that cannot be");
  }
  template <typename Archive>
  static void variance(Archive& archive, double& number) {
    archive.value(number);
    archive.check(number > 0 && number <= kLargestVariance, "holds a variance that cannot be");
  }
  template <typename Archive, typename Choice>
  static void choice(Archive& archive, Choice& value, Choice last) {
    auto number = static_cast<std::uint8_t>(value);
    archive.value(number);
    archive.check(number <= static_cast<std::uint8_t>(last), "holds a choice that is none");
    value = static_cast<Choice>(number);
  }
  template <typename Archive>
  static void text(Archive& archive, std::string& value) {
    archive_numbers(archive, value);
  }

  template <typename Archive>
  static void fields(Archive& archive, mot::Cxcywh& box) {
    for (double* value : {&box.cx, &box.cy, &box.width, &box.height}) real(archive, *value);
  }
  template <typename Archive>
  static void fields(Archive& archive, mot::Tlwh& box) {
    for (double* value : {&box.left, &box.top, &box.width, &box.height}) real(archive, *value);
  }
  template <typename Archive>
  static void fields(Archive& archive, KalmanState& state) {
    for (double& value : state.mean) real(archive, value);
    for (double& value : state.velocity) real(archive, value);
    variance(archive, state.position_variance);
    archive.value(state.covariance);
    archive.check(std::abs(state.covariance) <= kLargestVariance,
                  "holds a covariance that cannot be");
    variance(archive, state.velocity_variance);
  }

  template <typename Archive>
  static void fields(Archive& archive, AppearanceGallery& gallery, int dimension) {
    const auto size = static_cast<std::size_t>(dimension);
    archive_numbers(archive, gallery.ordinals_);
    archive_numbers(archive, gallery.features_);
    archive.value(gallery.count_);
    archive.value(gallery.stride_);
    auto& ordinals = gallery.ordinals_;
    archive.check(
        gallery.features_.size() == ordinals.size() * size &&
            ordinals.size() <= 2 * gallery.capacity_ && gallery.count_ >= 0 &&
            gallery.count_ <= std::int64_t{1} << 50 && gallery.stride_ >= 1 &&
            gallery.stride_ <= std::int64_t{1} << 50 &&
            std::adjacent_find(ordinals.begin(), ordinals.end(), std::greater_equal()) ==
                ordinals.end() &&
            (ordinals.empty() || (ordinals.front() >= 0 && ordinals.back() < gallery.count_)) &&
            (gallery.count_ > 0) == !ordinals.empty(),
        "holds a gallery that cannot be");
    gallery.dimension_ = ordinals.empty() ? 0 : size;
  }

  template <typename Archive>
  static void fields(Archive& archive, TrackHistory& history, int frame) {
    if constexpr (!Archive::kReads) history.drop_forgotten();
    archive_list(
        archive, history.entries_, [] { return TrackHistory::Entry{}; },
        [&](TrackHistory::Entry& entry) {
          whole(archive, entry.frame, 1, frame);
          choice(archive, entry.source, BoxSource::boosted);
          archive.value(entry.merged);
          score(archive, entry.score);
          fields(archive, entry.measured);
          fields(archive, entry.filtered);
          fields(archive, entry.forward);
          for (double* value :
               {&entry.gain.position_by_position, &entry.gain.position_by_velocity,
                &entry.gain.velocity_by_position, &entry.gain.velocity_by_velocity}) {
            real(archive, *value);
          }
          bool smoothed = entry.smoothed.has_value();
          archive.value(smoothed);
          if (smoothed) {
            if (!entry.smoothed) entry.smoothed.emplace();
            fields(archive, *entry.smoothed);
          }
        });
    const auto& entries = history.entries_;
    archive.check(!entries.empty() && std::adjacent_find(entries.begin(), entries.end(),
                                                         [](const auto& x, const auto& y) {
                                                           return x.frame >= y.frame;
                                                         }) == entries.end(),
                  "holds boxes out of order");
  }

  template <typename Archive>
  static void fields(Archive& archive, Tracklet& tracklet, int frame, int dimension) {
    whole(archive, tracklet.id, 1, kLatest);
    whole(archive, tracklet.first_frame, 1, frame);
    fields(archive, tracklet.first_box);
    whole(archive, tracklet.last_frame, tracklet.first_frame, frame);
    whole(archive, tracklet.state_frame, tracklet.last_frame, frame);
    fields(archive, tracklet.state);
    whole(archive, tracklet.misses, 0, frame);
    whole(archive, tracklet.feature_frame, 0, frame);
    whole(archive, tracklet.boosted_frame, Tracklet::kNever, frame);
    archive.value(tracklet.looked_back);
    archive.value(tracklet.reported);
    whole(archive, tracklet.confidence.length, 0, kLatest);
    score(archive, tracklet.confidence.score_sum);
    for (std::uint16_t& boxes : tracklet.unsettled) archive.value(boxes);
    archive.value(tracklet.shape.aspect);
    whole(archive, tracklet.shape.boxes, 0, BodyShape::kRecent);
    archive.check(tracklet.shape.boxes == 0
                      ? tracklet.shape.aspect == 0
                      : tracklet.shape.aspect > 0 && tracklet.shape.aspect <= kLargest,
                  "holds a shape that cannot be");
    fields(archive, tracklet.gallery, dimension);
    fields(archive, tracklet.history, frame);
    archive.check(tracklet.history.entries_.back().frame == tracklet.last_frame,
                  "holds a track that does not end where it ends");
  }

  // Tracker::State is private to Tracker, whose members deduce it.
  template <typename Archive, typename State>
  static void tracklet_list(Archive& archive, State& state, Tracklets& tracklets) {
    archive_list(
        archive, tracklets,
        [&] {
          return std::make_unique<Tracklet>(0, 0, state.options.appearance.gallery_size,
                                            state.output.rules());
        },
        [&](auto& tracklet) { fields(archive, *tracklet, state.frame, state.dimension); });
    for (const auto& tracklet : tracklets) {
      archive.check(tracklet->id <= state.last_id, "holds an id that was not given yet");
    }
    archive.check(std::adjacent_find(tracklets.begin(), tracklets.end(),
                                     [](const auto& x, const auto& y) { return x->id >= y->id; }) ==
                      tracklets.end(),
                  "holds ids out of order");
  }

  template <typename Archive>
  static void fields(Archive& archive, UnclaimedDetections& unclaimed, int frame) {
    int before = 0;
    archive_list(
        archive, unclaimed.frames_, [] { return UnclaimedDetections::Frame{}; },
        [&](UnclaimedDetections::Frame& entry) {
          whole(archive, entry.frame, before + 1, frame);
          before = entry.frame;
          archive_list(
              archive, entry.boxes, [] { return mot::Detection{}; },
              [&](mot::Detection& detection) {
                fields(archive, detection.box);
                score(archive, detection.score);
              });
        });
  }

  template <typename Archive>
  static void merges(Archive& archive, std::vector<IdMerge>& list) {
    archive_list(
        archive, list, [] { return IdMerge{}; },
        [&](IdMerge& merge) {
          whole(archive, merge.from, 1, kLatest);
          whole(archive, merge.to, 1, kLatest);
        });
  }

  template <typename Archive>
  static void fields(Archive& archive, TrackOutput& output, int frame) {
    whole(archive, output.decided_, 0, frame);
    whole(archive, output.reported_, 0, frame);
    int before = output.decided_;
    archive_list(
        archive, output.waiting_, [] { return TrackOutput::Waiting{}; },
        [&](TrackOutput::Waiting& waiting) {
          whole(archive, waiting.frame, before + 1, frame);
          before = waiting.frame;
          for (double* value :
               {&waiting.back.a, &waiting.back.b, &waiting.back.tx, &waiting.back.ty}) {
            real(archive, *value);
          }
        });
    merges(archive, output.merges_);
    before = 0;
    archive_list(
        archive, output.held_, [] { return TrackOutput::Held{}; },
        [&](TrackOutput::Held& held) {
          whole(archive, held.frame, before + 1, output.decided_);
          before = held.frame;
          whole(archive, held.finished.frame, 1, output.reported_);
          merges(archive, held.finished.merges);
          archive_list(
              archive, held.finished.boxes, [] { return TrackedBox{}; },
              [&](TrackedBox& box) {
                whole(archive, box.id, 1, kLatest);
                fields(archive, box.box);
                score(archive, box.score);
                choice(archive, box.source, BoxSource::interpolated);
              });
        });
  }

  template <typename Archive>
  static void fields(Archive& archive, AffinityHistogram& histogram) {
    std::int64_t sum = 0;
    for (std::int32_t& bin : histogram.bins_) {
      archive.value(bin);
      archive.check(bin >= 0, "holds a count that cannot be");
      sum += bin;
    }
    archive.check(sum < AffinityHistogram::kMost, "holds a count that cannot be");
    histogram.count_ = sum;
  }

  template <typename Archive>
  static void fields(Archive& archive, SceneCalibration& scene) {
    for (AffinityHistogram* histogram : {&scene.strangers_, &scene.stranger_tracks_, &scene.own_}) {
      fields(archive, *histogram);
    }
    for (SceneReport::Scores& scores : scene.report_.scores) {
      archive.value(scores.boxes);
      archive.value(scores.people);
      archive.check(scores.people >= 0 && scores.people <= scores.boxes &&
                        scores.boxes <= std::int64_t{1} << 60,
                    "holds a count that cannot be");
    }
    scene.update();
  }

  template <typename Archive>
  static void fields(Archive& archive, FrameClock& clock, int frame) {
    bool known = clock.last_time_.has_value();
    archive.value(known);
    if (known) {
      if (!clock.last_time_) clock.last_time_ = 0;
      archive.value(*clock.last_time_);
    }
    archive.value(clock.origin_time_);
    whole(archive, clock.origin_frame_, 0, frame);
  }

  template <typename Archive>
  static void fields(Archive& archive, TrackerStats& stats) {
    for (std::int64_t* count : {&stats.frames, &stats.detections, &stats.suppressed,
                                &stats.embedded, &stats.without_embedding, &stats.tracklets,
                                &stats.boosted, &stats.merges, &stats.tracks}) {
      archive.value(*count);
      archive.check(*count >= 0 && *count <= std::int64_t{1} << 60, "holds a count that cannot be");
    }
    for (double* seconds : {&stats.predict_seconds, &stats.embed_seconds, &stats.assign_seconds,
                            &stats.boost_seconds, &stats.associate_seconds, &stats.emit_seconds}) {
      archive.value(*seconds);
    }
  }

  // What must be the same in the tracker that goes on.
  template <typename Archive, typename State>
  static void identity(Archive& archive, const State& state) {
    for (const auto& option : tracker_option_table()) {
      if (option.name == "scene") continue;  // what was learned may be frozen
      const std::string here = option.name + " " + option.get(state.options);
      std::string there = here;
      text(archive, there);
      archive.check(there == here, ("is of a tracker with another --" + option.name).c_str());
    }
    const std::string here = state.descriptor == nullptr ? "" : state.descriptor->name();
    std::string there = here;
    text(archive, there);
    archive.check(there == here, "is of a tracker with another appearance model");
    double tau_a = state.tau_a;
    archive.value(tau_a);
    archive.check(tau_a == state.tau_a, "is of a tracker with another tau_a");
  }

  template <typename Archive, typename State>
  static void whole_state(Archive& archive, State& state) {
    identity(archive, state);
    whole(archive, state.dimension, 0, 1 << 20);
    const int now = state.descriptor == nullptr ? 0 : state.descriptor->dimension();
    archive.check(state.dimension == 0 || now == 0 || state.dimension == now,
                  "is of an appearance model with vectors of another length");
    whole(archive, state.frame, 0, kLatest);
    whole(archive, state.associated, 0, state.frame);
    whole(archive, state.looked, 0, state.frame);
    whole(archive, state.last_id, 0, kLatest);
    fields(archive, state.clock, state.frame);
    fields(archive, state.scene);
    tracklet_list(archive, state, state.active);
    tracklet_list(archive, state, state.idle);
    fields(archive, state.unclaimed, state.frame);
    fields(archive, state.output, state.frame);
    fields(archive, state.stats);
  }
};

std::vector<std::byte> Tracker::save() const {
  state_->require_open();
  StateWriter content;
  Snapshot::whole_state(content, *state_);
  const std::vector<std::byte> bytes = content.take();
  StateWriter file;
  file.value(kMagic);
  file.value(Snapshot::kVersion);
  file.value(checksum(bytes));
  std::vector<std::byte> all = file.take();
  all.insert(all.end(), bytes.begin(), bytes.end());
  return all;
}

void Tracker::restore(std::span<const std::byte> snapshot) {
  StateReader head(snapshot);
  std::uint32_t magic = 0, version = 0;
  std::uint64_t sum = 0;
  head.value(magic);
  head.check(magic == kMagic, "is none of a tracker");
  head.value(version);
  head.check(version == Snapshot::kVersion, "is of another version of the program");
  head.value(sum);
  const auto bytes = snapshot.last(head.left());
  head.check(checksum(bytes) == sum, "is damaged");
  auto fresh = std::make_unique<State>(state_->options, state_->descriptor);
  StateReader content(bytes);
  Snapshot::whole_state(content, *fresh);
  content.check(content.left() == 0, "goes on behind its end");
  std::set<int> ids;
  for (const Tracklets* group : {&fresh->active, &fresh->idle}) {
    for (const auto& tracklet : *group) {
      content.check(ids.insert(tracklet->id).second, "holds an id twice");
    }
  }
  fresh->track_ended = std::move(state_->track_ended);
  fresh->tracklet_dropped = std::move(state_->tracklet_dropped);
  fresh->association.observer = std::move(state_->association.observer);
  state_ = std::move(fresh);
}

}  // namespace sdmt::track
