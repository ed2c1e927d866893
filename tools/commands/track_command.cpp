// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/tracker_arguments.h"
#include "report/run_report_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/file_detections.h"
#include "sdmt/pipeline/frame_replay.h"
#include "sdmt/pipeline/hog_detector.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/pipeline/track_renderer.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/video_file.h"

namespace sdmt::tools {

namespace {

constexpr double kUnknownFrameRate = 25;

struct TrackCommand {
  std::string input;
  std::string detections;
  std::string output;
  std::string jsonl;
  std::string render;
  std::string json;
  std::string explain;
  bool stats = false;
  pipeline::HogOptions hog;
  TrackerArguments tracker;

  void run() const;

 private:
  // Throws when the sequence has no frames and something needs them.
  void check_input(const pipeline::FrameSource& source, bool hog_wanted) const;
};

// Draws the finished frames into a video.
class VideoWriter : public pipeline::TrackWriter {
 public:
  VideoWriter(const std::string& path, const std::string& input,
              const pipeline::FrameSource& source)
      : file_(path, source.frame_rate() > 0 ? source.frame_rate() : kUnknownFrameRate),
        replay_(input, source) {}

  void add(const pipeline::Frame& frame) { replay_.add(frame); }
  void write(const track::FinishedFrame& frame) override {
    cv::Mat image = replay_.next();
    renderer_.draw(frame, image);
    file_.write(image);
  }
  void commit() override { file_.commit(); }

 private:
  pipeline::VideoFile file_;
  pipeline::FrameReplay replay_;
  pipeline::TrackRenderer renderer_;
};

// A CSV line for each decision about two tracklets.
class Explanation {
 public:
  Explanation(const std::string& path, track::Tracker& tracker) : file_(path) {
    file_.write("frame,older,newer,gap,affinity,verdict\n");
    tracker.on_association([this](const track::AssociationDecision& decision) {
      file_.write(fmt::format("{},{},{},{},{:.4f},{}\n", decision.frame, decision.older,
                              decision.newer, decision.gap, decision.affinity,
                              track::to_string(decision.verdict)));
    });
  }
  void commit() { file_.commit(); }

 private:
  io::OutputFile file_;
};

// --detections, or what the input offers.
std::string chosen_detections(const std::string& detections, const std::string& input) {
  if (!detections.empty()) return detections;
  if (!mot::Sequence::is_sequence(input)) return "hog";
  const auto file = mot::Sequence::read(input).detections();
  return std::filesystem::exists(file) ? file.string() : "hog";
}

void warn(const std::string& text) { say(stderr, "sdmt track: warning: {}\n", text); }

// The detections of a file; says what may be wrong with their scores.
mot::DetectionFile read_detections(const std::string& path, track::TrackerOptions& options) {
  auto file = mot::DetectionFile::read(path);
  if (!options.input.use_scores || file.size() == 0) return file;
  if (!file.has_scores()) {
    options.input.use_scores = false;
    warn(path + ": all scores are equal, every detection is taken as certain");
    return file;
  }
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const mot::Detection& detection : file.detections()) {
    low = std::min(low, detection.score);
    high = std::max(high, detection.score);
  }
  if (!options.input.calibration && (low < 0 || high > 1)) {
    warn(
        fmt::format("{}: scores from {:.4g} to {:.4g} are no probabilities; thresholds may not "
                    "fit them, see --calibration",
                    path, low, high));
  }
  return file;
}

void TrackCommand::check_input(const pipeline::FrameSource& source, bool hog_wanted) const {
  if (source.has_images()) return;
  if (hog_wanted) {
    throw std::invalid_argument(input +
                                ": the sequence has no frames, and the people detector "
                                "looks at them; give --detections FILE");
  }
  if (tracker.uses_appearance()) {
    throw std::invalid_argument(input +
                                ": the sequence has no frames, and appearance looks at "
                                "them; track by motion with --no-appearance");
  }
  if (!render.empty()) {
    throw std::invalid_argument(input + ": the sequence has no frames to draw on for --render");
  }
}

void TrackCommand::run() const {
  if (output.empty() && jsonl.empty() && render.empty() && json.empty() && !stats) {
    throw std::invalid_argument(
        "nothing to do: give --output, --jsonl, --render, --json or --stats");
  }
  const StopSignal stop;
  track::TrackerOptions options = tracker.options;
  options.validate();
  const auto source = pipeline::open_frame_source(input);
  const std::string wanted = chosen_detections(detections, input);
  const bool hog_wanted = wanted == "hog";
  check_input(*source, hog_wanted);

  std::unique_ptr<pipeline::DetectionSource> boxes;
  if (hog_wanted) {
    boxes = std::make_unique<pipeline::HogDetector>(hog);
    if (options.input.calibration) warn("--calibration is not used: hog gives probabilities");
    options.input.calibration.reset();
  } else {
    boxes = std::make_unique<pipeline::FileDetections>(read_detections(wanted, options));
  }

  // Everything that can be wrong with the outputs is found before the work begins.
  check_outputs(
      {{"INPUT", input}, {"--detections", hog_wanted ? "" : wanted}, {"--model", tracker.model}},
      {{"--output", output},
       {"--jsonl", jsonl},
       {"--render", render},
       {"--json", json},
       {"--explain", explain}});
  std::vector<std::unique_ptr<pipeline::TrackWriter>> writers;
  if (!output.empty()) writers.push_back(pipeline::make_mot_writer(output));
  if (!jsonl.empty()) writers.push_back(pipeline::make_jsonl_writer(jsonl));
  VideoWriter* video = nullptr;
  if (!render.empty()) {
    auto writer = std::make_unique<VideoWriter>(render, input, *source);
    video = writer.get();
    writers.push_back(std::move(writer));
  }
  std::optional<io::OutputFile> json_file;
  if (!json.empty()) json_file.emplace(json);
  const auto appearance = tracker.load_appearance(warn);
  track::Tracker engine(options, appearance.get());
  std::optional<Explanation> explanation;
  if (!explain.empty()) explanation.emplace(explain, engine);

  pipeline::RunReport report;
  {
    Progress progress("tracking", source->frame_count(), "frames");
    pipeline::RunObservers observers;
    observers.read = [&](const pipeline::Frame& frame) {
      if (video != nullptr) video->add(frame);
      progress.update(frame.number);
    };
    observers.finished = [&](const track::FinishedFrame& frame) {
      for (const auto& writer : writers) writer->write(frame);
    };
    observers.warning = warn;
    observers.stop = [&] { return stop.requested(); };
    const bool images =
        hog_wanted || appearance != nullptr || (video != nullptr && !source->repeatable());
    report = pipeline::run_sequence(*source, *boxes, engine, images, observers);
  }
  for (const auto& writer : writers) writer->commit();
  if (explanation) explanation->commit();
  if (json_file) {
    json_file->write(run_report_json(report));
    json_file->commit();
  }
  std::FILE* out = jsonl == "-" ? stderr : stdout;
  say(out, "{}", run_summary(report));
  if (stats) say(out, "{}", stage_table(report));
  if (source->endless() && !stop.requested()) {
    throw std::runtime_error(fmt::format(
        "{}: gives no more frames; the {} that it gave are written", input, report.stats.frames));
  }
}

}  // namespace

void add_track_command(CLI::App& app) {
  auto command = std::make_shared<TrackCommand>();
  CLI::App* sub =
      app.add_subcommand("track", "Track pedestrians through a video or image sequence");
  sub->add_option("input", command->input,
                  "MOT sequence folder, image folder, video file, camera:N or rtsp:// URL")
      ->required()
      ->type_name("INPUT");
  sub->add_option("--output", command->output, "Tracks as MOTChallenge result rows")
      ->type_name("FILE");
  sub->add_option("--detections", command->detections,
                  "MOT det.txt, or hog: OpenCV's people detector [the sequence's det/det.txt, "
                  "else hog]")
      ->type_name("FILE|hog");
  sub->add_option("--hog-min-height", command->hog.min_person_height,
                  "Smallest person the people detector looks for, pixels")
      ->capture_default_str();
  sub->add_option("--jsonl", command->jsonl, "Finished frames as JSON lines; - for standard output")
      ->type_name("FILE");
  sub->add_option("--render", command->render, "Video with the tracks drawn in (.mp4, .mkv, .avi)")
      ->type_name("FILE");
  sub->add_option("--json", command->json, "Counts and speed as JSON")->type_name("FILE");
  sub->add_option("--explain", command->explain,
                  "CSV of which tracks were joined, and why others were not")
      ->type_name("FILE");
  sub->add_flag("--stats", command->stats, "Print milliseconds by stage");
  add_tracker_arguments(*sub, command->tracker);
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
