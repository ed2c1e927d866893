// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/eval/benchmark.h"
#include "sdmt/eval/ground_truth.h"
#include "sdmt/eval/held_out.h"
#include "sdmt/image/crop_descriptor.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/track/score_calibration.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::tools {

/// A sequence to choose options on, with the detections of one detector.
struct TuningSequence {
  mot::Sequence sequence;
  eval::GroundTruth gt;
  eval::Benchmark benchmark = eval::Benchmark::mot15;
  std::string detector;  ///< the name of the file in det/
  mot::DetectionFile detections;
  std::optional<track::ScoreCalibration> calibration;  ///< unless the options have one
};

/// Option NAME with the values that are tried.
struct TunedOption {
  std::string name;
  std::vector<std::string> values;
};
/// Reads `NAME=VALUE,VALUE,...`. Throws std::invalid_argument for an option that the tracker does
/// not have, values that it does not take, and one named twice.
TunedOption parse_tuned_option(const std::string& text);

/// The options to run, the first ones being the base's.
struct TuningSetting {
  track::TrackerOptions options;
  std::vector<std::string> values;  ///< of each tuned option
};
/// The base and all combinations of values, or so many of them, drawn by `seed`, the base among
/// them. Combinations that validate() refuses are left out.
std::vector<TuningSetting> tuning_settings(const track::TrackerOptions& base,
                                           const std::vector<TunedOption>& tuned, int most,
                                           std::uint64_t seed);

struct TuningPlan {
  std::vector<TuningSequence> sequences;
  std::vector<TunedOption> tuned;
  std::vector<TuningSetting> settings;
  int draws = 4;
  double drop = 0.02;  ///< share of boxes left out in each draw but the first
  std::uint64_t seed = 1;
  std::optional<double> tau_a;  ///< of the detections' embeddings; nothing: motion alone
};

/// The embeddings of the boxes that a tracker may ask for, for detections that have none: those of
/// `appearance` on the sequences' frames. Throws what reading and embedding throw.
void embed_detections(TuningPlan& plan, image::CropDescriptor& appearance,
                      const std::function<void(int frames)>& progress);

/// All runs: the settings', and one row more for ByteTrack, smoothed and filled as the base. Those
/// that `state` (empty: none) holds already are read from there, the others are added to it as they
/// end, by all threads. Nothing when `stop` said so. Throws std::invalid_argument for a state of
/// another search.
std::optional<eval::RunGrid> run_tuning(const TuningPlan& plan, const std::filesystem::path& state,
                                        const std::function<void(std::int64_t runs)>& progress,
                                        const std::function<bool()>& stop);

/// What was found, from counts alone: the same for any number of threads and interruptions.
nlohmann::ordered_json tuning_json(const TuningPlan& plan, const eval::RunGrid& grid);
std::string tuning_text(const nlohmann::ordered_json& found);
/// The chosen setting as a --config file: what differs from the tuned preset.
nlohmann::ordered_json tuned_preset(const TuningPlan& plan, const eval::RunGrid& grid);

}  // namespace sdmt::tools
