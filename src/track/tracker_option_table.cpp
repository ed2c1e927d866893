// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/tracker_option_table.h"

#include <array>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace sdmt::track {

namespace {

[[noreturn]] void refuse(const char* name, std::string_view text, const std::string& expected) {
  throw std::invalid_argument(std::string(name) + " is '" + std::string(text) + "', expected " +
                              expected);
}

template <typename Number>
Number parse(const char* name, std::string_view text, const char* expected) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) refuse(name, text, expected);
  return value;
}

template <typename Number>
std::string print(Number value) {
  std::array<char, 64> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

TrackerOption number(const char* name, double TrackerOptions::*field, const char* help) {
  return {name, help, false,
          [=](TrackerOptions& options, std::string_view text) {
            options.*field = parse<double>(name, text, "a number");
          },
          [=](const TrackerOptions& options) { return print(options.*field); }};
}

TrackerOption whole(const char* name, int TrackerOptions::*field, const char* help) {
  return {name, help, false,
          [=](TrackerOptions& options, std::string_view text) {
            options.*field = parse<int>(name, text, "a whole number");
          },
          [=](const TrackerOptions& options) { return print(options.*field); }};
}

// A number that somebody else provides when it is not given.
TrackerOption threshold(const char* name, std::optional<double> TrackerOptions::*field,
                        const char* help) {
  return {name, help, false,
          [=](TrackerOptions& options, std::string_view text) {
            options.*field = text == "auto"
                                 ? std::nullopt
                                 : std::optional(parse<double>(name, text, "a number or auto"));
          },
          [=](const TrackerOptions& options) {
            return options.*field ? print(*(options.*field)) : std::string("auto");
          }};
}

TrackerOption on_off(const char* name, bool TrackerOptions::*field, const char* help) {
  return {name, help, true,
          [=](TrackerOptions& options, std::string_view text) {
            if (text != "true" && text != "false") refuse(name, text, "true or false");
            options.*field = text == "true";
          },
          [=](const TrackerOptions& options) {
            return std::string(options.*field ? "true" : "false");
          }};
}

template <typename Choice>
TrackerOption choice(const char* name, Choice TrackerOptions::*field, const char* help,
                     std::vector<std::pair<std::string_view, Choice>> words) {
  return {name, help, false,
          [=](TrackerOptions& options, std::string_view text) {
            std::string known;
            for (const auto& [word, value] : words) {
              if (text == word) {
                options.*field = value;
                return;
              }
              known += (known.empty() ? "" : ", ") + std::string(word);
            }
            refuse(name, text, "one of " + known);
          },
          [=](const TrackerOptions& options) {
            for (const auto& [word, value] : words) {
              if (options.*field == value) return std::string(word);
            }
            return std::string();
          }};
}

TrackerOption calibration() {
  return {"calibration",
          "how scores become probabilities: none, frcnn, acf, synthetic or MIDPOINT,SCALE", false,
          [](TrackerOptions& options, std::string_view text) {
            options.calibration = parse_calibration(text);
          },
          [](const TrackerOptions& options) {
            if (!options.calibration) return std::string("none");
            return print(options.calibration->midpoint) + "," + print(options.calibration->scale);
          }};
}

TrackerOption delay() {
  return {"delay", "frames between a frame and its output: auto, 0 (strictly online), N or inf",
          false,
          [](TrackerOptions& options, std::string_view text) { options.delay = parse_delay(text); },
          [](const TrackerOptions& options) {
            if (options.delay == TrackerOptions::kAutoDelay) return std::string("auto");
            if (options.delay == TrackerOptions::kUnlimitedDelay) return std::string("inf");
            return print(options.delay);
          }};
}

std::vector<TrackerOption> make_table() {
  using Options = TrackerOptions;
  return {
      calibration(),
      on_off("scores", &Options::use_scores, "use detection scores; off: every box is certain"),
      number("min-confidence", &Options::min_confidence, "drop detections with a lower score"),
      number("nms", &Options::nms,
             "drop detections that overlap a better one by more (IoU 0..1, 1: keep all)"),
      number("strong-confidence", &Options::strong_confidence,
             "score from which a detection starts a track and is matched first"),
      number("weak-iou", &Options::weak_iou, "motion gate of weaker detections (IoU 0..1)"),
      number("position-noise", &Options::position_noise,
             "noise of detected and predicted positions, in box heights"),
      number("velocity-noise", &Options::velocity_noise,
             "noise of the velocity a frame, in box heights"),
      number("min-iou", &Options::min_iou, "tau_m, motion gate (IoU 0..1)"),
      whole("max-misses", &Options::max_misses,
            "frames without a detection after which a tracklet is inactive (>= 1)"),
      whole("association-horizon", &Options::association_horizon,
            "frames after that in which it can be associated (>= 0)"),
      threshold("tau-a", &Options::appearance_threshold,
                "tau_a, appearance gate; auto: the model's less tau-a-margin"),
      number("tau-a-margin", &Options::threshold_margin, "taken off the model's threshold (-1..1)"),
      number("lambda", &Options::lambda, "weight of appearance against motion (0..1)"),
      on_off("appearance-gate", &Options::appearance_gate, "tau_a restricts assignment"),
      choice("gallery-distance", &Options::gallery_distance,
             "distance to the stored states: mean or nearest",
             {{"mean", GalleryDistance::mean}, {"nearest", GalleryDistance::nearest}}),
      choice("gallery-selection", &Options::gallery_selection,
             "states kept by a long tracklet: spread, first or last",
             {{"spread", GallerySelection::spread},
              {"first", GallerySelection::first},
              {"last", GallerySelection::last}}),
      whole("gallery-size", &Options::gallery_size, "N, stored states a tracklet (1..1000)"),
      on_off("rescale-affinity", &Options::rescale_affinity,
             "map both affinities from their gates to 0..1 before mixing"),
      number("feature-min-confidence", &Options::feature_min_confidence,
             "score from which a detection's appearance is stored"),
      choice("embed", &Options::embed, "which detections are embedded: always or needed",
             {{"always", EmbedPolicy::always}, {"needed", EmbedPolicy::needed}}),
      whole("embed-refresh", &Options::embed_refresh,
            "with --embed needed: embed everybody in every so many frames (>= 1)"),
      whole("min-length", &Options::min_length, "tau_l, detections a reported track has (>= 1)"),
      number("min-mean-confidence", &Options::min_mean_confidence,
             "tau_c, least mean score of a reported track"),
      number("max-mean-cost", &Options::max_mean_cost,
             "largest mean of 1 - affinity of a reported track"),
      on_off("boosting", &Options::boosting,
             "search by appearance where the detector found nothing"),
      whole("boost-grid", &Options::boost_grid, "positions sampled along x and y (odd, 1..31)"),
      number("boost-reach", &Options::boost_reach, "largest shift in box sizes (0..2)"),
      number("boost-margin", &Options::boost_margin,
             "affinity above tau-a that a sample must have (0..1)"),
      number("boost-scale-step", &Options::boost_scale_step,
             "sizes sampled: 1 - step, 1, 1 + step (0..0.9)"),
      whole("boost-interval", &Options::boost_interval,
            "boost a track at most once in this many frames (>= 1)"),
      number("boost-nms", &Options::boost_nms,
             "IoU above which boosted boxes are duplicates (0..1)"),
      on_off("boost-one-pass", &Options::boost_one_pass,
             "look once at the surroundings instead of at every sample"),
      on_off("association", &Options::association, "join tracklets across gaps"),
      on_off("motion-association", &Options::motion_association,
             "without appearance: join tracklets by motion alone"),
      whole("association-interval", &Options::association_interval,
            "frames between associations (>= 1)"),
      threshold("association-threshold", &Options::association_threshold,
                "affinity above which tracklets are joined; auto: tau_a"),
      number("association-reach", &Options::association_reach,
             "farthest from the prediction that appearance may find the person again, in box "
             "heights; 0: the boxes must overlap"),
      on_off("literal-association", &Options::literal_association,
             "oldest tracklet first, as the paper lists it; off: best pair first"),
      choice("fill", &Options::fill, "gaps filled: none, merged (of associations) or all",
             {{"none", FillGaps::none}, {"merged", FillGaps::merged}, {"all", FillGaps::all}}),
      whole("max-fill", &Options::max_fill, "longest gap filled, in frames (>= 1)"),
      choice("report", &Options::report, "boxes reported: smoothed, filtered or detection",
             {{"smoothed", ReportBox::smoothed},
              {"filtered", ReportBox::filtered},
              {"detection", ReportBox::detection}}),
      number("smoothing-position-noise", &Options::smoothing_position_noise,
             "the smoother's noise of positions a frame, in box heights"),
      number("smoothing-velocity-noise", &Options::smoothing_velocity_noise,
             "the smoother's noise of velocities a frame, in box heights"),
      delay(),
  };
}

}  // namespace

std::span<const TrackerOption> tracker_option_table() {
  static const std::vector<TrackerOption> table = make_table();
  return table;
}

}  // namespace sdmt::track
