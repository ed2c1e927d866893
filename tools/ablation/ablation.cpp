// SPDX-License-Identifier: Apache-2.0
#include "ablation/ablation.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "cli/text_table.h"
#include "sdmt/image/color_histogram.h"
#include "sdmt/pipeline/file_detections.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/track/result_rows.h"
#include "sdmt/track/track_smoothing.h"
#include "sdmt/track/tracker.h"

namespace sdmt::tools {

using nlohmann::ordered_json;

namespace {

struct Tracked {
  std::vector<mot::ResultRow> results;
  std::int64_t frames = 0;
  double seconds = 0;
};

Tracked run_sort(const AblationSequence& input, const track::SortOptions& options,
                 const std::function<void()>& frame_done) {
  using Clock = std::chrono::steady_clock;
  track::SortTracker tracker(options);
  Tracked out;
  for (int frame = 1; frame <= input.gt.num_frames; ++frame) {
    const auto start = Clock::now();
    const auto finished = tracker.update(input.detections.frame(frame));
    out.seconds += std::chrono::duration<double>(Clock::now() - start).count();
    track::append_results(finished, out.results);
    ++out.frames;
    frame_done();
  }
  return out;
}

Tracked run_bytetrack(const AblationSequence& input, const AblationVariant& variant,
                      const std::function<void()>& frame_done) {
  using Clock = std::chrono::steady_clock;
  const ByteTrackRow& row = *variant.bytetrack;
  track::ByteTracker tracker(
      {.report = row.smoothed ? track::ReportBox::detection : track::ReportBox::filtered});
  std::vector<track::FinishedFrame> frames;
  Tracked out;
  for (int frame = 1; frame <= input.gt.num_frames; ++frame) {
    const auto given = input.detections.frame(frame);
    std::vector<mot::Detection> detections(given.begin(), given.end());
    if (row.calibration) {
      for (auto& detection : detections) {
        detection.score = row.calibration->probability(detection.score);
      }
    }
    const auto start = Clock::now();
    frames.push_back(tracker.update(detections));
    out.seconds += std::chrono::duration<double>(Clock::now() - start).count();
    ++out.frames;
    frame_done();
  }
  if (row.smoothed) {
    const auto start = Clock::now();
    frames = track::smooth_tracks(frames, variant.options.output, variant.options.motion);
    out.seconds += std::chrono::duration<double>(Clock::now() - start).count();
  }
  for (const auto& frame : frames) track::append_results(frame, out.results);
  return out;
}

Tracked run_tracker(const AblationSequence& input, const AblationVariant& variant,
                    image::CropDescriptor* appearance, const std::function<void()>& frame_done,
                    const std::function<void(const std::string&)>& warning) {
  const auto frames = pipeline::open_frame_source(input.sequence.folder.string());
  pipeline::FileDetections detections(input.detections);
  track::Tracker tracker(variant.options, appearance);
  Tracked out;
  pipeline::RunObservers observers;
  observers.read = [&](const pipeline::Frame&) { frame_done(); };
  observers.finished = [&](const track::FinishedFrame& frame, const pipeline::FrameTime&) {
    track::append_results(frame, out.results);
  };
  observers.warning = warning;
  const auto report =
      pipeline::run_sequence(*frames, detections, tracker, appearance != nullptr, observers);
  out.frames = report.stats.frames;
  out.seconds = report.tracker_seconds();
  return out;
}

std::string missing_frames(std::span<const AblationSequence> sequences) {
  for (const auto& input : sequences) {
    if (!input.sequence.has_images()) return input.gt.name;
  }
  return {};
}

ordered_json figures_json(const eval::Scores& scores) {
  ordered_json json;
  json["mota"] = scores.clear.mota;
  json["fp"] = scores.clear.clr_fp;
  json["fn"] = scores.clear.clr_fn;
  json["ids"] = scores.clear.idsw;
  json["idf1"] = scores.identity.idf1;
  json["hota"] = eval::mean(scores.hota.hota);
  return json;
}

}  // namespace

AblationRow run_variant(const AblationVariant& variant, std::span<const AblationSequence> sequences,
                        image::CropDescriptor* network, const AblationRun& run,
                        const std::function<void(int frames)>& progress,
                        const std::function<void(const std::string&)>& warning) {
  AblationRow row;
  row.variant = variant;
  if (variant.needs_frames()) {
    const auto blind = missing_frames(sequences);
    if (!blind.empty()) {
      row.skipped = "needs frames, and " + blind + " has none";
      return row;
    }
  }
  image::ColorHistogramDescriptor histogram;
  image::CropDescriptor* appearance = nullptr;
  if (variant.appearance == VariantAppearance::histogram) appearance = &histogram;
  if (variant.appearance == VariantAppearance::network) {
    if (network == nullptr) throw std::logic_error(variant.name + " needs an embedding network");
    appearance = network;
  }
  row.evaluation.benchmark = run.benchmark;
  row.evaluation.compat = run.compat;
  int done = 0;
  double seconds = 0;
  std::int64_t frames = 0;
  const auto frame_done = [&] { progress(++done); };
  for (const auto& input : sequences) {
    AblationVariant fitted = variant;
    fitted.options.fit_to_picture({input.sequence.width, input.sequence.height}, input.gt.name);
    const auto tracked = variant.sort ? run_sort(input, *variant.sort, frame_done)
                         : variant.bytetrack
                             ? run_bytetrack(input, fitted, frame_done)
                             : run_tracker(input, fitted, appearance, frame_done, warning);
    seconds += tracked.seconds;
    frames += tracked.frames;
    row.evaluation.sequences.push_back(
        evaluate_sequence(input.sequence.folder, input.gt, tracked.results,
                          variant.name + " on " + input.gt.name, run.benchmark, run.compat));
  }
  combine_sequences(row.evaluation);
  row.fps = seconds > 0 ? static_cast<double>(frames) / seconds : 0;
  return row;
}

ordered_json to_json(const AblationRun& run) {
  ordered_json json;
  json["benchmark"] = eval::to_string(run.benchmark);
  json["compat"] = eval::to_string(run.compat);
  json["detections"] = run.detections;
  json["rows"] = ordered_json::array();
  for (const auto& row : run.rows) {
    ordered_json item;
    item["variant"] = row.variant.name;
    if (row.skipped.empty()) {
      item.update(figures_json(row.evaluation.combined));
      item["fps"] = row.fps;
      item["ids_trackeval"] = row.evaluation.idsw_trackeval;
      item["ids_devkit"] = row.evaluation.idsw_devkit;
      for (const auto& sequence : row.evaluation.sequences) {
        item["sequences"][sequence.prepared.name] = figures_json(sequence.scores);
      }
    } else {
      item["skipped"] = row.skipped;
    }
    if (const auto& paper = row.variant.paper) {
      item["paper"] = {{"mota", paper->mota},
                       {"fp", paper->fp},
                       {"fn", paper->fn},
                       {"ids", paper->ids},
                       {"fps", paper->fps}};
    }
    json["rows"].push_back(std::move(item));
  }
  return json;
}

std::string to_text(const AblationRun& run) {
  std::vector<std::string> header{"variant", "MOTA", "FP", "FN", "IDs", "FPS", "IDF1", "HOTA"};
  const bool published = std::any_of(run.rows.begin(), run.rows.end(), [](const AblationRow& row) {
    return row.variant.paper.has_value();
  });
  if (published) {
    header.insert(header.end(), {"paper: MOTA", "its FP", "its FN", "its IDs", "its FPS"});
  }
  TextTable table(std::move(header));
  std::string notes;
  const auto percent = [](double fraction) { return fmt::format("{:.1f}", 100 * fraction); };
  for (const auto& row : run.rows) {
    std::vector<std::string> cells{row.variant.name};
    if (row.skipped.empty()) {
      const auto& s = row.evaluation.combined;
      cells.insert(cells.end(), {percent(s.clear.mota), std::to_string(s.clear.clr_fp),
                                 std::to_string(s.clear.clr_fn), std::to_string(s.clear.idsw),
                                 fmt::format("{:.1f}", row.fps), percent(s.identity.idf1),
                                 percent(eval::mean(s.hota.hota))});
    } else {
      cells.insert(cells.end(), 7, "-");
      notes += fmt::format("{}: not run, it {}\n", row.variant.name, row.skipped);
    }
    if (const auto& paper = row.variant.paper) {
      cells.insert(cells.end(),
                   {percent(paper->mota), std::to_string(paper->fp), std::to_string(paper->fn),
                    std::to_string(paper->ids), fmt::format("{:.1f}", paper->fps)});
    } else if (published) {
      cells.insert(cells.end(), 5, "");
    }
    table.add_row(std::move(cells));
  }
  return table.str() + notes;
}

}  // namespace sdmt::tools
