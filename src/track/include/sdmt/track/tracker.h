// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdmt/image/camera_motion.h"
#include "sdmt/image/crop_descriptor.h"
#include "sdmt/image/image_view.h"
#include "sdmt/mot/detection.h"
#include "sdmt/track/appearance_gallery.h"
#include "sdmt/track/association_decision.h"
#include "sdmt/track/finished_frame.h"
#include "sdmt/track/scene.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// What is known of a frame beside its detections.
struct FrameContext {
  /// nullptr where there is none (unreadable): the frame is assigned by motion.
  const image::ImageView* image = nullptr;
  /// Seconds on any clock. Where the options say what a frame is (InputOptions::frame_rate), frames
  /// may then come irregularly, late or not at all: motion is predicted, and intervals, horizons
  /// and delays are measured, in frames of that rate, to which times are rounded. Frames that never
  /// came are no misses. Must rise; a jump so long that every track ends before counts as just that
  /// long. Without a time the frame is one after the last.
  std::optional<double> time = std::nullopt;
  /// How the camera moved since the frame given before: of image::CameraMotionEstimator, or of who
  /// knows better, such as a robot. Everything that the tracker knows moves along; boxes are
  /// reported where they are in their own frame. Nothing: it stands still. Values beyond 1e6, or a
  /// zoom beyond 0.1..10, are refused as a wrong time is.
  std::optional<image::CameraMotion> camera = std::nullopt;
};

/// What a tracker has done so far.
struct TrackerStats {
  std::int64_t frames = 0;             ///< given, skipped ones included
  std::int64_t detections = 0;         ///< as given
  std::int64_t suppressed = 0;         ///< dropped by min_confidence or nms
  std::int64_t embedded = 0;           ///< boxes given to the appearance model, boosting included
  std::int64_t without_embedding = 0;  ///< of those, boxes without a valid crop: matched by motion
  std::int64_t tracklets = 0;          ///< born
  std::int64_t boosted = 0;            ///< boosted boxes that were assigned
  std::int64_t merges = 0;
  std::int64_t tracks = 0;  ///< ids reported
  /// Seconds of wall time by stage.
  double predict_seconds = 0, embed_seconds = 0, assign_seconds = 0, boost_seconds = 0,
         associate_seconds = 0, emit_seconds = 0;
};

/// A reported person who is gone for so long that the id will not come again, or whom the end of
/// the input found.
struct EndedTrack {
  int id = 0;
  int first_frame = 0, last_frame = 0;  ///< of the boxes; gaps between may not be in the output
  const AppearanceGallery& gallery;     ///< empty without an appearance model; for the call only
};

/// The Siamese Deep Metric Tracker (section III of the paper), online with a fixed delay.
///
///   Tracker tracker(TrackerOptions{}, &appearance);
///   while (camera.read(frame))
///     for (const FinishedFrame& done : tracker.update(detect(frame), &frame)) show(done);
///   for (const FinishedFrame& done : tracker.finish()) show(done);
///
/// Deterministic: the same calls give the same output for any number of threads. Memory and time a
/// frame depend on the people of the last seconds, not on how long it runs. A tracker and its
/// appearance model serve one thread at a time; trackers share nothing else.
class Tracker {
 public:
  /// Without an appearance model the tracker works by motion alone. The model must outlive it.
  /// Throws std::invalid_argument as TrackerOptions::validate().
  explicit Tracker(const TrackerOptions& options = {}, image::CropDescriptor* descriptor = nullptr);
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Takes the detections of the next frame, possibly none, and returns the frames finished by it,
  /// in order; the reference holds until the next call. Call it for every frame that a detector
  /// looked at, also where it found nothing. Throws std::invalid_argument for a box that is not
  /// finite, has no extent or lies beyond 1e12 pixels, a score that is not finite, or a time that
  /// does not rise, and whatever the appearance model throws; the tracker is then as if the call
  /// had not been made.
  const std::vector<FinishedFrame>& update(std::span<const mot::Detection> detections,
                                           const FrameContext& frame);
  const std::vector<FinishedFrame>& update(std::span<const mot::Detection> detections,
                                           const image::ImageView* image = nullptr) {
    return update(detections, FrameContext{.image = image});
  }
  /// The next frame, at which no detector looked: people move on as predicted, nobody misses a
  /// detection, and what update() would report of such a frame is reported.
  const std::vector<FinishedFrame>& skip(const FrameContext& frame = {});

  /// The end of the input: one last association, then all frames still held back. Afterwards only
  /// stats() and scene() may be called, update() and finish() throw std::logic_error.
  const std::vector<FinishedFrame>& finish();

  /// Everything that the tracker knows, between two frames: a tracker with the same options and
  /// appearance that restores it goes on with the same bytes, in another process, on another
  /// machine, with another number of threads. Some 300 bytes a box held back for the delay, and a
  /// stored vector's floats. Throws std::logic_error after finish().
  std::vector<std::byte> save() const;
  /// Throws std::invalid_argument `snapshot: ...` for bytes that save() did not make (any bytes may
  /// be given), another version, other options or another appearance; the tracker is then as it
  /// was.
  void restore(std::span<const std::byte> snapshot);

  const TrackerStats& stats() const;
  /// What it has learned of its scene; also after finish().
  const SceneReport& scene() const;

  /// Called with every decision about a pair of positive tracklets whose times fit, each time it is
  /// made. For explaining; costs time.
  void on_association(std::function<void(const AssociationDecision&)> observer);

  /// Called with every tracklet that is given up before it was a track. For explaining.
  void on_dropped(std::function<void(const DroppedTracklet&)> observer);

  /// Called by update() and finish() for every reported track that ends, by id among those of one
  /// call. Ids merged into older ones do not end. With gallery(), what it takes to recognise people
  /// from one camera in another.
  void on_track_ended(std::function<void(const EndedTrack&)> observer);
  /// The appearance stored under an id; nullptr for one that is not known or has ended. Holds until
  /// the next call of update() or finish(). After finish(): of all that were left.
  const AppearanceGallery* gallery(int id) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sdmt::track
