// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sdmt/eval/prepare.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/first_error.h"
#include "sdmt/media/image_file.h"
#include "sdmt/nn/random.h"
#include "sdmt/track/bytetrack_baseline.h"
#include "sdmt/track/given_embeddings.h"
#include "sdmt/track/pixel_rect.h"
#include "sdmt/track/result_rows.h"
#include "sdmt/track/track_smoothing.h"
#include "sdmt/track/tracker.h"
#include "sdmt/track/tracker_option_table.h"
#include "tuning/tuning.h"

namespace sdmt::tools {

namespace {

// The boxes of a frame that a draw leaves, with their vectors.
class Draw {
 public:
  Draw(const TuningPlan& plan, int sequence, int draw)
      : detections_(plan.sequences[sequence].detections),
        drop_(draw == 0 ? 0 : plan.drop),
        random_(plan.seed + static_cast<std::uint64_t>(draw),
                static_cast<std::uint64_t>(sequence)) {}

  void next(int frame, std::vector<mot::Detection>& boxes, std::vector<float>& vectors) {
    boxes.clear();
    vectors.clear();
    const auto all = detections_.frame(frame);
    const auto rows = detections_.embeddings(frame);
    const auto size = static_cast<std::size_t>(detections_.dimension());
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (drop_ > 0 && random_.uniform() < drop_) continue;
      boxes.push_back(all[i]);
      const auto row = rows.subspan(i * size, size);
      vectors.insert(vectors.end(), row.begin(), row.end());
    }
  }

 private:
  const mot::DetectionFile& detections_;
  double drop_;
  nn::Random random_;
};

track::TrackerOptions options_for(const TuningSequence& input, track::TrackerOptions options) {
  if (!options.input.calibration) options.input.calibration = input.calibration;
  return options;
}

double probability(const track::TrackerOptions& options, const mot::Detection& box) {
  return options.input.calibration ? options.input.calibration->probability(box.score) : box.score;
}

std::vector<mot::ResultRow> track_sequence(const TuningPlan& plan, int sequence, int draw,
                                           const track::TrackerOptions& given_options) {
  const TuningSequence& input = plan.sequences[sequence];
  track::TrackerOptions options = options_for(input, given_options);
  track::GivenEmbeddings embeddings;
  const bool by_appearance = plan.tau_a.has_value();
  if (by_appearance && !options.appearance.tau_a) {
    options.appearance.tau_a = *plan.tau_a - options.appearance.tau_a_margin;
  }
  track::Tracker tracker(options, by_appearance ? &embeddings : nullptr);
  static constexpr std::uint8_t kPixel[3] = {};
  const image::ImageView nothing{kPixel, 1, 1, 3, image::ChannelOrder::bgr};
  Draw drawn(plan, sequence, draw);
  std::vector<mot::ResultRow> rows;
  std::vector<mot::Detection> boxes;
  std::vector<float> vectors;
  for (int frame = 1; frame <= input.gt.num_frames; ++frame) {
    drawn.next(frame, boxes, vectors);
    if (by_appearance) embeddings.set(boxes, vectors);
    for (const auto& done : tracker.update(boxes, by_appearance ? &nothing : nullptr)) {
      track::append_results(done, rows);
    }
  }
  for (const auto& done : tracker.finish()) track::append_results(done, rows);
  return rows;
}

std::vector<mot::ResultRow> bytetrack_sequence(const TuningPlan& plan, int sequence, int draw) {
  const TuningSequence& input = plan.sequences[sequence];
  const track::TrackerOptions options = options_for(input, plan.settings.front().options);
  track::ByteTracker tracker({.report = track::ReportBox::detection});
  Draw drawn(plan, sequence, draw);
  std::vector<track::FinishedFrame> frames;
  std::vector<mot::Detection> boxes;
  std::vector<float> vectors;
  for (int frame = 1; frame <= input.gt.num_frames; ++frame) {
    drawn.next(frame, boxes, vectors);
    for (mot::Detection& box : boxes) box.score = probability(options, box);
    frames.push_back(tracker.update(boxes));
  }
  std::vector<mot::ResultRow> rows;
  for (const auto& frame : track::smooth_tracks(frames, options.output, options.motion)) {
    track::append_results(frame, rows);
  }
  return rows;
}

eval::RunCounts run_once(const TuningPlan& plan, int setting, int sequence, int draw) {
  const bool peer = setting == static_cast<int>(plan.settings.size());
  const auto rows = peer ? bytetrack_sequence(plan, sequence, draw)
                         : track_sequence(plan, sequence, draw, plan.settings[setting].options);
  const TuningSequence& input = plan.sequences[sequence];
  const auto prepared = eval::prepare_sequence(input.gt, rows, input.gt.name, input.benchmark,
                                               eval::Compat::trackeval);
  return eval::RunCounts::of(eval::clear_mot(prepared.similarities, eval::Compat::trackeval),
                             eval::identity(prepared.similarities));
}

// All that decides about the counts, in one line: a state of another search cannot be gone on with.
std::string search_name(const TuningPlan& plan) {
  std::string text =
      fmt::format("sdmt tune 1 draws {} drop {} seed {}", plan.draws, plan.drop, plan.seed);
  if (plan.tau_a) text += fmt::format(" tau_a {}", *plan.tau_a);
  for (const TuningSequence& input : plan.sequences) {
    text += fmt::format(" | {} {} {} boxes {} values", input.gt.name, input.detector,
                        input.detections.size(), input.detections.dimension());
    if (input.calibration) {
      text += fmt::format(" {} {}", input.calibration->midpoint, input.calibration->scale);
    }
  }
  for (const TuningSetting& setting : plan.settings) {
    text += " |";
    for (const auto& option : track::tracker_option_table()) {
      text += " " + option.get(setting.options);
    }
  }
  return text;
}

// Runs that are done, a line each: setting, sequence, draw and the counts.
class State {
 public:
  State(const std::filesystem::path& path, const TuningPlan& plan, eval::RunGrid& grid,
        std::vector<bool>& done)
      : path_(path) {
    if (path_.empty()) return;
    const std::string name = search_name(plan);
    if (std::filesystem::exists(path_)) {
      read(name, grid, done);
      file_.open(path_, std::ios::app);
      file_ << "\n";  // behind a line that a killed run left unfinished
    } else {
      file_.open(path_);
      file_ << name << "\n";
    }
    check();
  }

  void add(int setting, int sequence, int draw, const eval::RunCounts& run) {
    if (path_.empty()) return;
    const std::scoped_lock lock(mutex_);
    file_ << fmt::format("{} {} {} {} {} {} {} {} {} {} .\n", setting, sequence, draw, run.tp,
                         run.fp, run.fn, run.idsw, run.idtp, run.idfp, run.idfn)
          << std::flush;
    check();
  }

 private:
  void read(const std::string& name, eval::RunGrid& grid, std::vector<bool>& done) {
    std::istringstream file(io::read_text(path_));
    std::string line;
    if (!std::getline(file, line) || line != name) {
      throw std::invalid_argument(path_.string() +
                                  ": is the state of another search, expected a new file");
    }
    while (std::getline(file, line)) {
      std::istringstream words(line);
      int setting = 0, sequence = 0, draw = 0;
      eval::RunCounts run;
      std::string end;
      words >> setting >> sequence >> draw >> run.tp >> run.fp >> run.fn >> run.idsw >> run.idtp >>
          run.idfp >> run.idfn >> end;
      if (end != "." || setting < 0 || setting >= grid.settings() || sequence < 0 ||
          sequence >= grid.sequences() || draw < 0 || draw >= grid.draws()) {
        continue;  // unfinished: done again
      }
      grid.at(setting, sequence, draw) = run;
      done[(setting * grid.sequences() + sequence) * grid.draws() + draw] = true;
    }
  }
  void check() const {
    if (!file_) throw std::runtime_error(path_.string() + ": cannot be written");
  }

  std::filesystem::path path_;
  std::ofstream file_;
  std::mutex mutex_;
};

}  // namespace

void embed_detections(TuningPlan& plan, image::CropDescriptor& appearance,
                      const std::function<void(int frames)>& progress) {
  double least = plan.settings.front().options.input.strong_confidence;
  for (const TuningSetting& setting : plan.settings) {
    least = std::min(least, setting.options.input.strong_confidence);
  }
  int frames = 0;
  for (TuningSequence& input : plan.sequences) {
    if (input.detections.dimension() > 0) continue;
    const auto options = options_for(input, plan.settings.front().options);
    std::vector<mot::DetectionRow> rows;
    std::vector<std::size_t> looked_at;
    std::vector<image::Crop> crops;
    image::DescriptorRows vectors;
    for (int frame = 1; frame <= input.gt.num_frames; ++frame, progress(++frames)) {
      const auto image = media::read_image(input.sequence.image(frame));
      const image::ImageView view = image.view();
      crops.clear();
      looked_at.clear();
      for (const mot::Detection& box : input.detections.frame(frame)) {
        rows.push_back({frame, box, std::vector<float>(appearance.dimension(), 0.0F)});
        if (probability(options, box) < least) continue;
        looked_at.push_back(rows.size() - 1);
        crops.push_back({view, track::to_pixel_rect(box.box)});
      }
      appearance.describe(crops, vectors);
      for (std::size_t i = 0; i < crops.size(); ++i) {
        const auto vector = vectors.row(i);
        rows[looked_at[i]].embedding.assign(vector.begin(), vector.end());
      }
    }
    input.detections = mot::DetectionFile::from_rows(std::move(rows), input.gt.name);
  }
}

std::optional<eval::RunGrid> run_tuning(const TuningPlan& plan, const std::filesystem::path& state,
                                        const std::function<void(std::int64_t runs)>& progress,
                                        const std::function<bool()>& stop) {
  std::vector<std::string> places;
  for (const TuningSequence& input : plan.sequences) places.push_back(input.gt.name);
  eval::RunGrid grid(std::move(places), static_cast<int>(plan.settings.size()) + 1, plan.draws);
  const int runs = grid.settings() * grid.sequences() * grid.draws();
  std::vector<bool> known(runs, false);
  State kept(state, plan, grid, known);
  std::vector<int> left;
  for (int run = 0; run < runs; ++run) {
    if (!known[run]) left.push_back(run);
  }
  std::atomic<bool> stopped = false;
  std::mutex mutex;
  std::int64_t done = runs - static_cast<std::int64_t>(left.size());
  io::FirstError error;
  const int count = static_cast<int>(left.size());
#pragma omp parallel for schedule(dynamic)
  for (int i = 0; i < count; ++i) {
    error.guard([&] {
      if (stopped) return;
      const int draw = left[i] % grid.draws();
      const int sequence = left[i] / grid.draws() % grid.sequences();
      const int setting = left[i] / grid.draws() / grid.sequences();
      const eval::RunCounts run = run_once(plan, setting, sequence, draw);
      grid.at(setting, sequence, draw) = run;
      kept.add(setting, sequence, draw, run);
      const std::scoped_lock lock(mutex);
      progress(++done);
      if (stop()) stopped = true;
    });
  }
  error.rethrow();
  if (stopped && done < runs) return std::nullopt;
  return grid;
}

}  // namespace sdmt::tools
