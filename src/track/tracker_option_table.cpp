// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker_option_table.h"

#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace sdmt::track {

namespace {

using io::number_text;
using Table = io::OptionTable<TrackerOptions>;

constexpr io::Range kAny;
constexpr io::Range kShare{.low = 0, .high = 1};
// A gate that nothing can pass, or that divides by zero when affinities are rescaled, is an error.
constexpr io::Range kGate{.low = 0, .high = 1, .below = true};
constexpr io::Range kAffinityGate{.low = -1, .high = 1, .below = true};
constexpr io::Range kNoise{.low = 0, .high = 100, .above = true};
constexpr io::Range kFrames{.low = 1, .high = 1'000'000};
constexpr io::Range kFramesOrNone{.low = 0, .high = 1'000'000};

int parse_delay(std::string_view text) {
  if (text == "auto") return OutputOptions::kAutoDelay;
  if (text == "inf") return OutputOptions::kUnlimitedDelay;
  const auto frames = io::parse_number<int>(text);
  if (!frames || *frames < 0) {
    io::refuse_value("delay", io::quoted(text), "auto, inf or a number of frames >= 0");
  }
  return *frames;
}

std::string delay_text(int delay) {
  if (delay == OutputOptions::kAutoDelay) return "auto";
  return delay == OutputOptions::kUnlimitedDelay ? "inf" : number_text(delay);
}

image::PictureSize parse_amodal(std::string_view text) {
  if (text == "off") return {};
  if (text == "auto") return OutputOptions::kInputSize;
  const auto x = text.find('x');
  const auto size = [](std::string_view number) {
    return io::parse_number<int>(number).value_or(0);
  };
  const image::PictureSize picture{size(text.substr(0, x)),
                                   x == text.npos ? 0 : size(text.substr(x + 1))};
  if (picture.width < 1 || picture.height < 1) {
    io::refuse_value("amodal", io::quoted(text), "off, auto or the picture's size as 1920x1080");
  }
  return picture;
}

std::string amodal_text(const image::PictureSize& picture) {
  if (picture == image::PictureSize{}) return "off";
  if (picture == OutputOptions::kInputSize) return "auto";
  return number_text(picture.width) + "x" + number_text(picture.height);
}

std::string calibration_text(const std::optional<ScoreCalibration>& calibration) {
  if (!calibration) return "none";
  return number_text(calibration->midpoint) + "," + number_text(calibration->scale);
}

void add_input(Table& table) {
  table.group("input", &TrackerOptions::input)
      .value("calibration", &InputOptions::calibration, "how scores become probabilities",
             "none, frcnn, acf, synthetic or MIDPOINT,SCALE", parse_calibration, calibration_text,
             [](const auto& calibration) {
               if (calibration) calibration->validate();
             })
      .on_off("scores", &InputOptions::use_scores,
              "use detection scores; off: every box is certain")
      .number("min-confidence", &InputOptions::min_confidence, kAny,
              "drop detections with a lower score")
      .number("nms", &InputOptions::nms, kShare,
              "drop detections that overlap a better one by more (IoU); 1: keep all")
      .number("strong-confidence", &InputOptions::strong_confidence, kAny,
              "score from which a detection starts a track and is matched first")
      .number(
          "frame-rate", &InputOptions::frame_rate, {.low = 0, .high = 10'000},
          "frames a second that options mean, where boxes come with times; 0: times are not used");
}

void add_motion(Table& table) {
  table.group("motion", &TrackerOptions::motion)
      .number("position-noise", &MotionOptions::position_noise, kNoise,
              "noise of detected and predicted positions, in box heights")
      .number("velocity-noise", &MotionOptions::velocity_noise, kNoise,
              "noise of the velocity, in box heights per frame")
      .number("max-misses", &MotionOptions::max_misses, kFrames,
              "frames without a detection after which a tracklet is inactive")
      .number("score-noise", &MotionOptions::score_noise, {.low = 0, .high = 100},
              "a box of score 0 counts as 1 + this times as noisy as one of score 1")
      .number(
          "look-back", &MotionOptions::look_back, kFramesOrNone,
          "frames before its start in which a track, once it is one, finds boxes that nobody took");
}

void add_assignment(Table& table) {
  table.group("assignment", &TrackerOptions::assignment)
      .number("min-iou", &AssignmentOptions::min_iou, kGate, "tau_m, motion gate (IoU)")
      .number("weak-iou", &AssignmentOptions::weak_iou, kGate,
              "motion gate of detections below strong-confidence, and for looking back (IoU)")
      .number("lambda", &AssignmentOptions::lambda, kShare, "weight of appearance against motion")
      .on_off("appearance-gate", &AssignmentOptions::appearance_gate, "tau_a restricts assignment")
      .on_off("rescale-affinity", &AssignmentOptions::rescale_affinity,
              "map both affinities from their gates to 0..1 before mixing");
}

void add_appearance(Table& table) {
  table.group("appearance", &TrackerOptions::appearance)
      .number("tau-a", &AppearanceOptions::tau_a, "auto", kAffinityGate,
              "tau_a, appearance gate; auto: the model's less tau-a-margin")
      .number("tau-a-margin", &AppearanceOptions::tau_a_margin, {.low = -1, .high = 1},
              "taken off the model's tau_a")
      .choice("gallery-distance", &AppearanceOptions::gallery_distance,
              {{"mean", GalleryDistance::mean}, {"nearest", GalleryDistance::nearest}},
              "distance to the stored states")
      .number("gallery-size", &AppearanceOptions::gallery_size, {.low = 1, .high = 1000},
              "N, stored states of a tracklet")
      .choice("embed", &AppearanceOptions::embed,
              {{"always", EmbedPolicy::always}, {"needed", EmbedPolicy::needed}},
              "which detections are embedded")
      .number("embed-refresh", &AppearanceOptions::embed_refresh, kFrames,
              "with --embed needed: embed everybody in every so many frames");
}

void add_scene(Table& table) {
  table.group("scene", &TrackerOptions::scene)
      .choice("scene", &SceneOptions::learning,
              {{"off", SceneLearning::off},
               {"on", SceneLearning::on},
               {"frozen", SceneLearning::frozen}},
              "learn how alike people look here; frozen: keep what a snapshot knows")
      .number("false-match-rate", &SceneOptions::false_match_rate,
              {.low = 0, .high = 1, .above = true, .below = true},
              "share of strangers that may pass for each other in this scene");
}

void add_confidence(Table& table) {
  table.group("confidence", &TrackerOptions::confidence)
      .number("min-length", &ConfidenceOptions::min_length, kFrames,
              "tau_l, detections of a reported track")
      .number("min-mean-confidence", &ConfidenceOptions::min_mean_confidence, kAny,
              "tau_c, least mean score of a reported track");
}

void add_boosting(Table& table) {
  table.group("boosting", &TrackerOptions::boosting)
      .on_off("boosting", &BoostingOptions::enabled,
              "search by appearance where the detector found nothing")
      .number("boost-grid", &BoostingOptions::grid, {.low = 1, .high = 31, .odd = true},
              "positions sampled along x and y")
      .number("boost-reach", &BoostingOptions::reach, {.low = 0, .high = 2},
              "largest shift in box sizes")
      .number("boost-margin", &BoostingOptions::margin, kShare,
              "affinity above tau-a that a sample must have")
      .number("boost-scale-step", &BoostingOptions::scale_step, {.low = 0, .high = 0.9},
              "sizes sampled: 1 - step, 1, 1 + step")
      .number("boost-interval", &BoostingOptions::interval, kFrames,
              "boost a track at most once in this many frames")
      .number("boost-nms", &BoostingOptions::nms, kShare,
              "where a box was found: drop boxes that overlap a better one by more (IoU)")
      .on_off("boost-one-pass", &BoostingOptions::one_pass,
              "look once at the surroundings instead of at every sample");
}

void add_association(Table& table) {
  table.group("association", &TrackerOptions::association)
      .on_off("association", &AssociationOptions::enabled, "join tracklets across gaps")
      .on_off("motion-association", &AssociationOptions::by_motion,
              "without appearance: join tracklets by motion alone")
      .number(
          "motion-reach", &AssociationOptions::motion_reach, kNoise,
          "without appearance: how far tracklets that lead to each other may miss, in box heights")
      .number("association-interval", &AssociationOptions::interval, kFrames,
              "frames between associations")
      .number("association-horizon", &AssociationOptions::horizon, kFramesOrNone,
              "frames after max-misses in which a tracklet can be associated")
      .number("association-threshold", &AssociationOptions::threshold, "auto", kAffinityGate,
              "affinity above which tracklets are joined; auto: tau_a")
      .number("association-reach", &AssociationOptions::reach, {.low = 0, .high = 100},
              "farthest from the prediction that appearance may find the person again, in box "
              "heights; 0: the boxes must overlap")
      .on_off("literal-association", &AssociationOptions::literal,
              "oldest tracklet first, as the paper lists it; off: best pair first");
}

void add_output(Table& table) {
  table.group("output", &TrackerOptions::output)
      .choice("fill", &OutputOptions::fill,
              {{"none", FillGaps::none}, {"merged", FillGaps::merged}, {"all", FillGaps::all}},
              "gaps filled: none, those that association bridged, or all")
      .number("max-fill", &OutputOptions::max_fill, kFrames, "longest gap filled, in frames")
      .choice("report", &OutputOptions::report,
              {{"smoothed", ReportBox::smoothed},
               {"filtered", ReportBox::filtered},
               {"detection", ReportBox::detection}},
              "boxes reported")
      .number("smoothing-position-noise", &OutputOptions::smoothing_position_noise, kNoise,
              "the smoother's noise of positions, in box heights per frame")
      .number("smoothing-velocity-noise", &OutputOptions::smoothing_velocity_noise, kNoise,
              "the smoother's noise of velocities, in box heights per frame")
      .value("amodal", &OutputOptions::amodal,
             "report people whole where the picture's border cuts them",
             "off, auto (the input's size) or WIDTHxHEIGHT", parse_amodal, amodal_text,
             [](const image::PictureSize& picture) {
               if (picture == image::PictureSize{} || picture == OutputOptions::kInputSize) return;
               if (picture.width < 1 || picture.height < 1) {
                 io::refuse_value("amodal", amodal_text(picture), "off, auto or a size above 0");
               }
             })
      .value("delay", &OutputOptions::delay, "frames between a frame and its output",
             "auto, 0 (strictly online), N or inf", parse_delay, delay_text, [](int delay) {
               io::require(delay >= OutputOptions::kAutoDelay, "delay", delay, ">= 0");
             });
}

Table make_table() {
  Table table;
  add_input(table);
  add_motion(table);
  add_assignment(table);
  add_appearance(table);
  add_scene(table);
  add_confidence(table);
  add_boosting(table);
  add_association(table);
  add_output(table);
  return table;
}

}  // namespace

const Table& tracker_option_table() {
  static const Table table = make_table();
  return table;
}

}  // namespace sdmt::track
