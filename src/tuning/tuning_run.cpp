// SPDX-License-Identifier: Apache-2.0
#include "sdmt/tuning/tuning_run.h"

#include <atomic>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

#include "sdmt/eval/prepare.h"
#include "sdmt/io/first_error.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/bytetrack_baseline.h"
#include "sdmt/track/given_embeddings.h"
#include "sdmt/track/result_rows.h"
#include "sdmt/track/track_smoothing.h"
#include "sdmt/track/tracker.h"
#include "tuning_grid.h"
#include "tuning_state.h"

namespace sdmt::tuning {

namespace {

// Hands over, frame by frame, the boxes that a draw leaves, and their vectors.
void for_each_frame(const TuningPlan& plan, int sequence, int draw,
                    const std::function<void(std::vector<mot::Detection>& boxes,
                                             std::span<const float> vectors)>& take) {
  const TuningSequence& input = plan.sequences[sequence];
  const auto size = static_cast<std::size_t>(input.detections.dimension());
  const double drop = draw == 0 ? 0 : plan.drop;
  nn::Random random(plan.seed + static_cast<std::uint64_t>(draw),
                    static_cast<std::uint64_t>(sequence));
  std::vector<mot::Detection> boxes;
  std::vector<float> vectors;
  for (int frame = 1; frame <= input.gt.num_frames; ++frame) {
    boxes.clear();
    vectors.clear();
    const auto all = input.detections.frame(frame);
    const auto rows = input.detections.embeddings(frame);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (drop > 0 && random.uniform() < drop) continue;
      boxes.push_back(all[i]);
      const auto row = rows.subspan(i * size, size);
      vectors.insert(vectors.end(), row.begin(), row.end());
    }
    take(boxes, vectors);
  }
}

std::vector<mot::ResultRow> track_sequence(const TuningPlan& plan, int sequence, int draw,
                                           const track::TrackerOptions& given_options) {
  track::TrackerOptions options = plan.sequences[sequence].adjusted(given_options);
  track::GivenEmbeddings embeddings;
  const bool by_appearance = plan.tau_a.has_value();
  if (by_appearance && !options.appearance.tau_a) {
    options.appearance.tau_a = *plan.tau_a - options.appearance.tau_a_margin;
  }
  track::Tracker tracker(options, by_appearance ? &embeddings : nullptr);
  static constexpr std::uint8_t kPixel[3] = {};
  const image::ImageView nothing{kPixel, 1, 1, 3, image::ChannelOrder::bgr};
  std::vector<mot::ResultRow> rows;
  for_each_frame(plan, sequence, draw, [&](auto& boxes, auto vectors) {
    if (by_appearance) embeddings.set(boxes, vectors);
    for (const auto& done : tracker.update(boxes, by_appearance ? &nothing : nullptr)) {
      track::append_results(done, rows);
    }
  });
  for (const auto& done : tracker.finish()) track::append_results(done, rows);
  return rows;
}

std::vector<mot::ResultRow> bytetrack_sequence(const TuningPlan& plan, int sequence, int draw) {
  const track::TrackerOptions options =
      plan.sequences[sequence].adjusted(plan.settings.front().options);
  track::ByteTracker tracker({.report = track::ReportBox::detection});
  std::vector<track::FinishedFrame> frames;
  for_each_frame(plan, sequence, draw, [&](auto& boxes, auto) {
    for (mot::Detection& box : boxes) box.score = options.input.probability(box.score);
    frames.push_back(tracker.update(boxes));
  });
  std::vector<mot::ResultRow> rows;
  for (const auto& frame : track::smooth_tracks(frames, options.output, options.motion)) {
    track::append_results(frame, rows);
  }
  return rows;
}

eval::RunCounts run_once(const TuningPlan& plan, const TuningRun& run) {
  const bool peer = run.setting == static_cast<int>(plan.settings.size());
  const auto rows =
      peer ? bytetrack_sequence(plan, run.sequence, run.draw)
           : track_sequence(plan, run.sequence, run.draw, plan.settings[run.setting].options);
  const TuningSequence& input = plan.sequences[run.sequence];
  const auto prepared = eval::prepare_sequence(input.gt, rows, input.gt.name, input.benchmark,
                                               eval::Compat::trackeval);
  return eval::RunCounts::of(eval::clear_mot(prepared.similarities, eval::Compat::trackeval),
                             eval::identity(prepared.similarities));
}

std::vector<TuningRun> unknown_runs(const eval::RunGrid& grid, const TuningState& state) {
  std::vector<TuningRun> runs;
  for (int setting = 0; setting < grid.settings(); ++setting) {
    for (int sequence = 0; sequence < grid.sequences(); ++sequence) {
      for (int draw = 0; draw < grid.draws(); ++draw) {
        const TuningRun run{setting, sequence, draw};
        if (!state.knows(run)) runs.push_back(run);
      }
    }
  }
  return runs;
}

}  // namespace

std::optional<eval::RunGrid> run_tuning(const TuningPlan& plan, const std::filesystem::path& state,
                                        const std::function<void(std::int64_t runs)>& progress,
                                        const std::function<bool()>& stop) {
  eval::RunGrid grid = empty_grid(plan);
  TuningState kept(state, plan, grid);
  const std::vector<TuningRun> left = unknown_runs(grid, kept);
  std::int64_t done = plan.runs() - static_cast<std::int64_t>(left.size());
  std::atomic<bool> stopped = false;
  std::mutex mutex;
  io::FirstError error;
  const int count = static_cast<int>(left.size());
#pragma omp parallel for schedule(dynamic)
  for (int i = 0; i < count; ++i) {
    error.guard([&] {
      if (stopped || error.caught()) return;
      const TuningRun run = left[i];
      const eval::RunCounts counts = run_once(plan, run);
      grid.at(run.setting, run.sequence, run.draw) = counts;
      kept.add(run, counts);
      const std::scoped_lock lock(mutex);
      progress(++done);
      if (stop()) stopped = true;
    });
  }
  error.rethrow();
  if (stopped && done < plan.runs()) return std::nullopt;
  return grid;
}

}  // namespace sdmt::tuning
