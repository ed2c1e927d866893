// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>

#include "sdmt/image/picture_size.h"
#include "sdmt/track/scene.h"
#include "sdmt/track/score_calibration.h"

namespace sdmt::track {

/// How the distances between a detection and the stored states of a tracklet become one.
enum class GalleryDistance {
  mean,     ///< equation 2 of the paper
  nearest,  ///< the closest stored state decides: one view of a person is enough
};
/// Which boxes are embedded.
enum class EmbedPolicy {
  always,  ///< every strong detection of every frame, as in the paper
  needed,  ///< not those that motion alone assigns without doubt; see embed_refresh
};
/// Which gaps of a track are filled with interpolated boxes.
enum class FillGaps { none, merged, all };
/// Which box is reported for a frame with a detection.
enum class ReportBox {
  smoothed,   ///< Rauch-Tung-Striebel over the frames seen until the frame is finished
  filtered,   ///< the Kalman filter's estimate in that frame
  detection,  ///< the detection as it came
};

/// What comes in. Scores are those of the detector, or probabilities where a calibration is set.
struct InputOptions {
  std::optional<ScoreCalibration> calibration;
  /// Off: every detection counts as certain (score 1). For detectors that give no score.
  bool use_scores = true;
  /// Detections below are dropped. Default: none.
  double min_confidence = -std::numeric_limits<double>::infinity();
  /// Of two detections that overlap by more (IoU, 0..1) the one with the lower score is dropped
  /// before anything else sees it; 1 keeps all, as the paper does. Two boxes on one person start
  /// two tracks that steal each other's detections.
  double nms = 0.4;
  /// Detections from here on are strong: they are matched first, by appearance and motion, and
  /// start tracklets. Weaker ones only continue tracklets that are left over, by motion. -inf: all
  /// strong.
  double strong_confidence = 0.6;
  /// Frames a second that all options which count frames mean, where frames come with times
  /// (FrameContext::time); >= 0, 0: times are not looked at, every call is a frame.
  double frame_rate = 0;

  /// How sure the tracker takes a detection of that score to be: the score itself without a
  /// calibration, 1 without use_scores.
  double probability(double score) const;
};

/// How people move (section III-D). Noise is in units of the box height, as in DeepSORT.
struct MotionOptions {
  double position_noise = 1.0 / 20;  ///< of measurements and, per frame, of the prediction; > 0
  double velocity_noise = 1.0 / 80;  ///< per frame; > 0
  /// Frames in a row, of those that a detector looked at, without a detection after which a
  /// tracklet is inactive; >= 1.
  int max_misses = 6;
  /// A box of score 0 counts as 1 + score_noise times as noisy as one of score 1; >= 0. Detectors
  /// are unsure of people who are half hidden, and their boxes are then off too.
  double score_noise = 1;
  /// Frames before its first box in which a tracklet, once it is positive, takes boxes that no
  /// tracklet took (weak ones, mostly) where it must have come from; 0: none.
  int look_back = 10;
};

/// Which detection continues which tracklet (section III-D).
struct AssignmentOptions {
  double min_iou = 0.3;         ///< tau_m, strictly above; 0..1
  double weak_iou = 0.4;        ///< the same for weak detections, and for looking back
  double lambda = 0.5;          ///< weight of appearance in the affinity (equation 4), 0..1
  bool appearance_gate = true;  ///< off: tau_a does not restrict assignment
  /// Maps min_iou..1 and tau_a..1 to 0..1 before the two affinities are mixed. The gates leave
  /// appearance a range of 0.1 and motion one of 0.7: without it motion decides nearly alone.
  bool rescale_affinity = true;
};

/// How people look (sections III-B and III-D).
struct AppearanceOptions {
  /// tau_a, strictly above; default: the appearance model's less tau_a_margin.
  std::optional<double> tau_a;
  /// Taken off the model's tau_a; negative: added. -1..1. Validation chooses tau_a for one pair of
  /// crops. The nearest of twenty states is closer than that, also to another person, so
  /// GalleryDistance::nearest wants a stricter one.
  double tau_a_margin = -0.02;
  GalleryDistance gallery_distance = GalleryDistance::nearest;
  int gallery_size = 20;  ///< N, stored states a tracklet; 1..1000
  EmbedPolicy embed = EmbedPolicy::always;
  /// With EmbedPolicy::needed: everybody is embedded in every so many frames; >= 1.
  int embed_refresh = 6;
};

/// What the tracker learns of its scene, with an appearance model: how alike the people here look.
/// A threshold fits one network and the place that it was measured in; elsewhere half of all
/// strangers can pass it.
struct SceneOptions {
  SceneLearning learning = SceneLearning::off;
  /// The share of strangers that may pass for each other: thresholds are the affinities that so
  /// many exceed, and begin as tau_a. Where the person's own boxes would fail the gate of
  /// assignment in more than one of a hundred, it is lowered so far; lambda is multiplied by how
  /// well appearance tells people apart; where that is little, tracks are joined by motion. > 0 and
  /// < 1.
  double false_match_rate = 0.15;
};

/// Tracklet confidence (section III-E): a tracklet that misses one of these is negative and not
/// reported.
struct ConfidenceOptions {
  int min_length = 6;                ///< tau_l, assigned detections; >= 1
  double min_mean_confidence = 0.5;  ///< tau_c, mean score of the assigned detections
};

/// Detection boosting (section III-F).
struct BoostingOptions {
  bool enabled = false;
  int grid = 7;        ///< positions along x and along y; odd, 1..31
  double reach = 0.3;  ///< largest shift in box widths and heights; 0..2
  /// Affinity above tau_a that a sample must have; 0..1. The best of many samples passes a
  /// threshold for pairs too easily.
  double margin = 0.04;
  double scale_step = 0;  ///< sizes 1 - step, 1, 1 + step; 0..0.9, 0: the predicted one
  int interval = 2;       ///< a tracklet is boosted at most once in this many frames; >= 1
  /// Where a boosted box was found, boxes that overlap a better one by more (IoU, 0..1) are
  /// dropped: of the detector's the one with the lower score, and the boosted before any of them.
  double nms = 0.5;
  /// The network looks once at the surroundings of a prediction, and the samples, moved to its grid
  /// (see image::GridShift), are read out of what it saw; those that leave the image are left out,
  /// and `interval` counts searches, found or not. Off, as in the paper: every sample is a crop of
  /// its own, clipped to the image, and `interval` counts boosted boxes.
  bool one_pass = true;
};

/// Tracklet association (section III-G).
struct AssociationOptions {
  bool enabled = true;
  /// Without an appearance model: associate by motion alone or not at all, as the paper's row
  /// "without appearance modelling".
  bool by_motion = true;
  /// By motion alone two tracklets must lead to each other: the older one's prediction may miss the
  /// newer one's first box, and the newer one, followed backwards, the older one's last box by this
  /// much (distance of the centres in mean heights), and neither may be more than half as tall
  /// again as the other; > 0 and <= 100.
  double motion_reach = 0.6;
  int interval = 20;  ///< frames; >= 1
  /// Predictions after MotionOptions::max_misses for which a tracklet can be associated; >= 0.
  int horizon = 90;
  /// Affinity of two tracklets must be strictly above. Default: tau_a.
  std::optional<double> threshold;
  /// Judged by appearance, a newer tracklet may begin this far from the older one's prediction:
  /// distance of the centres in mean heights, strictly below; 0..100. 0: the boxes must overlap
  /// (IoU > 0), as in the paper. A standing person's box is narrow, so that overlap forgives a
  /// whole height up and down but a third of one sideways, where people go.
  double reach = 1;
  /// The best candidate of the oldest tracklet first, as the paper's listing; off: the best pair
  /// first.
  bool literal = false;
};

/// What comes out.
struct OutputOptions {
  FillGaps fill = FillGaps::all;
  int max_fill = 60;  ///< longest gap to fill, in missing frames; >= 1
  ReportBox report = ReportBox::smoothed;
  double smoothing_position_noise = 1.0 / 100;  ///< as position_noise, of the smoother's motion
  double smoothing_velocity_noise = 1.0 / 320;  ///< as velocity_noise
  /// Frames between a frame and its output. kAutoDelay: as many as decisions can need, see
  /// TrackerOptions::auto_delay(). 0: strictly online. kUnlimitedDelay: all output at finish().
  int delay = kAutoDelay;

  /// The picture's size: people whom its border cuts are reported as far as they reach beyond it,
  /// by the shape that they have where they are seen whole, as MOT16, MOT17 and MOT20 annotate
  /// them; most of MOT15 ends at the border. 0 by 0, the default: off. kInputSize stands for the
  /// size of an input that is yet to be opened, see TrackerOptions::fit_to_picture(); trackers
  /// refuse it. Association takes boxes as they come either way.
  image::PictureSize amodal;

  static constexpr int kAutoDelay = -1;
  static constexpr image::PictureSize kInputSize{-1, -1};
  static constexpr int kUnlimitedDelay = std::numeric_limits<int>::max();
};

/// Every number of the tracker, in the groups that its steps see. The defaults are the `tuned`
/// preset: the paper's tracker with a stricter input (calibrated scores, suppression of duplicates,
/// births from strong detections only) and smoothed output. Names on the command line, ranges and
/// help are in tracker_option_table().
struct TrackerOptions {
  InputOptions input;
  MotionOptions motion;
  AssignmentOptions assignment;
  AppearanceOptions appearance;
  SceneOptions scene;
  ConfidenceOptions confidence;
  BoostingOptions boosting;
  AssociationOptions association;
  OutputOptions output;

  /// The paper to the letter; where it is silent, as docs/tracking.md says.
  static TrackerOptions paper();
  static TrackerOptions tuned() { return {}; }
  /// What is known at once is said at once: every frame reported when it comes, a person from the
  /// second detection on, and remembered by assignment alone, which needs no second thoughts.
  static TrackerOptions online();

  /// The most frames that a tracklet, which gets its detections, takes to be long enough.
  int confirmation_frames() const;
  /// Frames after which nothing is known any more of a person who is not seen again.
  int memory_frames() const;
  /// The lag, in frames, at which the tracker decides about a frame when nothing shortens it:
  /// a gap, the boxes found by looking back, the frames until the tracklet behind it is long
  /// enough, and the wait for the next association. A longer delay changes no output, only when it
  /// comes.
  int auto_delay() const;
  /// The lag at which it does: the delay or auto_delay(), whichever is less.
  int decision_lag() const;

  /// Where `amodal` is to be the size of the input's picture, puts that there. Throws
  /// std::invalid_argument, naming `whose`, where it is not known (0 by 0).
  void fit_to_picture(const image::PictureSize& picture, const std::string& whose);

  /// Throws std::invalid_argument naming field, value and range.
  void validate() const;
};

}  // namespace sdmt::track
