// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "evaluation/evaluation.h"
#include "sdmt/image/crop_descriptor.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/track/bytetrack_baseline.h"
#include "sdmt/track/sort_baseline.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::tools {

/// A row of the paper's second table (ablation on the MOT16 training sequences).
struct PaperRow {
  double mota = 0;  ///< fraction
  int fp = 0, fn = 0, ids = 0;
  double fps = 0;
};

/// What tells people apart in a variant.
enum class VariantAppearance { none, histogram, network };

/// ByteTrack on calibrated scores: its online output, or smoothed and filled as ours.
struct ByteTrackRow {
  std::optional<track::ScoreCalibration> calibration;
  bool smoothed = false;
};

/// One configuration to be compared.
struct AblationVariant {
  std::string name;
  std::string short_name;  ///< for the axis of a plot
  VariantAppearance appearance = VariantAppearance::none;
  track::TrackerOptions options;
  std::optional<track::SortOptions> sort;  ///< SORT in place of our tracker
  std::optional<PaperRow> paper;
  std::optional<ByteTrackRow> bytetrack = {};  ///< ByteTrack without score fusion in its place

  bool needs_frames() const { return appearance != VariantAppearance::none; }
};

/// The six rows of the paper's table by its rules, SORT, ByteTrack online and smoothed and filled
/// as ours, the tuned preset with the network, with colour histograms and by motion alone, and the
/// online one by motion alone.
/// `calibration` is that of the detector; only ByteTrack, the tuned and the online rows use it, the
/// paper takes scores as they are. `amodal`: the same but for ByteTrack's online row report people
/// whole.
std::vector<AblationVariant> ablation_variants(
    const std::optional<track::ScoreCalibration>& calibration, bool amodal);

/// A sequence to run on, with its detections.
struct AblationSequence {
  mot::Sequence sequence;
  eval::GroundTruth gt;
  mot::DetectionFile detections;
};

/// What came out of one variant over all sequences.
struct AblationRow {
  AblationVariant variant;
  std::string skipped;    ///< why it was not run; empty when it was
  Evaluation evaluation;  ///< empty when skipped
  double fps = 0;         ///< frames a second inside the tracker, embedding included
};

struct AblationRun {
  eval::Benchmark benchmark = eval::Benchmark::mot16;
  eval::Compat compat = eval::Compat::trackeval;
  std::string detections;  ///< file name in det/
  std::vector<AblationRow> rows;
};

/// Runs a variant. `network` may be null when the variant does not use it. `progress` gets the
/// frames done so far, `warning` lines of text. Throws what trackers and readers throw.
AblationRow run_variant(const AblationVariant& variant, std::span<const AblationSequence> sequences,
                        image::CropDescriptor* network, const AblationRun& run,
                        const std::function<void(int frames)>& progress,
                        const std::function<void(const std::string&)>& warning);

/// {"benchmark", "compat", "detections", "rows": [{"variant", "mota", "fp", "fn", "ids", "fps",
/// "idf1", "hota", "paper": {...}, "sequences": {...}}]}: fractions. A row that was not run has
/// "skipped" in place of figures.
nlohmann::ordered_json to_json(const AblationRun& run);

/// The table for the terminal, the paper's figures beside ours.
std::string to_text(const AblationRun& run);

/// One HTML page: table, bars, HOTA over the localisation threshold, and the tracks of the row with
/// the best HOTA over time.
std::string ablation_html(const AblationRun& run);

}  // namespace sdmt::tools
