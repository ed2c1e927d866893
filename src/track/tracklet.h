// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "body_shape.h"
#include "sdmt/track/appearance_gallery.h"
#include "sdmt/track/kalman_filter.h"
#include "sdmt/track/scene.h"
#include "sdmt/track/tracker_options.h"
#include "track_history.h"

namespace sdmt::track {

/// Is a tracklet a person? (section III-E.) Counts assigned real detections;
/// boosted boxes leave no trace here.
struct TrackletConfidence {
  int length = 0;
  double score_sum = 0;

  /// `frames`: that the detection speaks for, with those before it at which nobody looked.
  void add(double score, int frames) {
    length += frames;
    score_sum += frames * score;
  }
  void add(const TrackletConfidence& other) {
    length += other.length;
    score_sum += other.score_sum;
  }
  bool positive(const ConfidenceOptions& options) const {
    return length >= options.min_length && score_sum >= options.min_mean_confidence * length;
  }
};

/// A piece of a person's track: detections joined by assignment, and the older pieces that
/// association joined to it.
struct Tracklet {
  /// `rules`, those of the output, must outlive it.
  Tracklet(int tracklet_id, int frame, int gallery_size, const OutputRules& rules)
      : id(tracklet_id),
        first_frame(frame),
        last_frame(frame),
        state_frame(frame),
        gallery(gallery_size),
        history(rules) {}

  int id;
  int first_frame;  ///< of the first box, merged pieces included
  mot::Cxcywh first_box;
  int last_frame;   ///< of the latest box
  int state_frame;  ///< of `state`: now while active, the last prediction after that
  KalmanState state;
  int misses = 0;         ///< predictions since the latest box
  int feature_frame = 0;  ///< when the gallery last grew; 0: never
  static constexpr int kNever = -1000000;
  int boosted_frame = kNever;  ///< when it was last boosted, or searched for in one pass
  bool looked_back = false;    ///< for boxes before its first one
  bool reported = false;       ///< a box of it is in the output: from then on it counts as positive
  TrackletConfidence confidence;
  /// Its boxes by their scores (SceneReport::scores), until it is known to be a person.
  std::array<std::uint16_t, SceneReport::kTenths> unsettled{};
  BodyShape shape;
  AppearanceGallery gallery;
  TrackHistory history;

  /// Takes an older piece of the same person into this one, which goes on under the older id.
  /// `decided`: the last frame in the output; where this piece is in it, so is the gap before it,
  /// which can then not be filled any more.
  void absorb(const Tracklet& older, int decided) {
    if (first_frame > decided) history.prepend(older.history);
    id = older.id;
    first_frame = older.first_frame;
    first_box = older.first_box;
    if (shape.boxes == 0) shape = older.shape;
    confidence.add(older.confidence);
    gallery.prepend(older.gallery);
    reported = reported || older.reported;
  }

  /// Where it comes from, found by looking back.
  void begin_with(const TrackHistory& before) {
    history.prepend(before);
    first_frame = before.start_frame();
    first_box = before.first_box();
  }

  /// The box expected in any frame.
  mot::Cxcywh predicted(int frame) const { return extrapolate(state, frame - state_frame); }
};

/// In order of id. Pointers stay valid while tracklets come and go.
using Tracklets = std::vector<std::unique_ptr<Tracklet>>;

}  // namespace sdmt::track
