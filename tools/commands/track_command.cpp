// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/detection_arguments.h"
#include "cli/live_arguments.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/tracker_arguments.h"
#include "report/run_report_text.h"
#include "report/zone_counts_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/association_log.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/zone_writer.h"

namespace sdmt::tools {

namespace {

void warn(const std::string& text) { say(stderr, "sdmt track: warning: {}\n", text); }

struct TrackCommand {
  std::string input;
  std::string output;
  std::string jsonl;
  std::string render;
  std::string json;
  std::string explain;
  std::string rotate;
  std::string zones;
  pipeline::ZoneFiles zone_files;
  std::string state;
  int state_every = 100;
  bool moving_camera = false;
  bool stats = false;
  DetectionArguments detections;
  LiveArguments live;
  TrackerArguments tracker;

  void run() const;
  // The zones for the input's picture. Throws when they do not fit it.
  zones::ZonePlan zone_plan(const pipeline::FrameSource& frames) const;

 private:
  // Throws when no output is wanted.
  void check_wanted() const;
  // Throws when an output cannot be written.
  void check_outputs(const pipeline::DetectionSource& boxes) const;
  // Throws when the sequence has no images and something needs them.
  void check_images(const pipeline::FrameSource& frames, pipeline::DetectionSource& boxes) const;
  // Throws when there is a state to be kept that some output or input cannot go on from.
  void check_state(const pipeline::FrameSource& frames) const;
  std::string run_name() const;
  // Throws when the boxes bring embeddings along that cannot be used as the options say.
  void check_embeddings(pipeline::DetectionSource& boxes) const;
  void report(const pipeline::RunReport& report) const;
};

// Everything that a run leaves behind.
class Outputs {
 public:
  Outputs(const TrackCommand& command, const pipeline::FrameSource& frames, track::Tracker& tracker)
      : unreadable_(warn) {
    std::optional<pipeline::Flowing> flowing;
    if (frames.live()) flowing = {pipeline::Rotation::parse(command.rotate), warn};
    if (!command.output.empty()) {
      writers_.push_back(pipeline::make_mot_writer(command.output, flowing));
    }
    if (!command.jsonl.empty()) {
      writers_.push_back(pipeline::make_jsonl_writer(
          command.jsonl, pipeline::display_name(command.input), flowing));
    }
    if (!command.render.empty()) {
      writers_.push_back(
          pipeline::make_video_writer(command.render, command.input, frames, unreadable_, flowing));
    }
    if (!command.zones.empty()) {
      auto writer = std::make_unique<pipeline::ZoneWriter>(command.zone_plan(frames),
                                                           command.zone_files, flowing);
      zones_ = writer.get();
      writers_.push_back(std::move(writer));
    }
    if (!command.json.empty()) json_.emplace(command.json);
    if (!command.explain.empty()) explanation_.emplace(command.explain, tracker);
  }

  pipeline::UnreadableFrames& unreadable() { return unreadable_; }
  bool need_images() const {
    return std::any_of(writers_.begin(), writers_.end(),
                       [](const auto& writer) { return writer->needs_images(); });
  }
  const pipeline::ZoneWriter* zones() const { return zones_; }
  void read(const pipeline::Frame& frame) {
    for (const auto& writer : writers_) writer->read(frame);
  }
  void write(const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
    for (const auto& writer : writers_) writer->write(frame, time);
  }
  // The video comes last: it is the one that fails on a full disk, and the others are to be kept.
  void commit(const pipeline::RunReport& report) {
    if (explanation_) explanation_->commit();
    if (json_) {
      json_->write(run_report_json(report));
      json_->commit();
    }
    for (const auto& writer : writers_) writer->commit();
  }

 private:
  pipeline::UnreadableFrames unreadable_;
  std::vector<std::unique_ptr<pipeline::TrackWriter>> writers_;
  const pipeline::ZoneWriter* zones_ = nullptr;  // one of them
  std::optional<io::OutputFile> json_;
  std::optional<pipeline::AssociationLog> explanation_;
};

void TrackCommand::check_wanted() const {
  if (output.empty() && jsonl.empty() && render.empty() && json.empty() && zones.empty() &&
      !stats) {
    throw std::invalid_argument(
        "nothing to do: give --output, --jsonl, --render, --zones, --json or --stats");
  }
}

void TrackCommand::check_outputs(const pipeline::DetectionSource& boxes) const {
  tools::check_outputs({{"INPUT", input},
                        {"--detections", boxes.file()},
                        {"--detector", detections.detector},
                        {"--model", tracker.model},
                        {"--zones", zones}},
                       {{"--output", output},
                        {"--jsonl", jsonl},
                        {"--render", render},
                        {"--json", json},
                        {"--explain", explain},
                        {"--state", state},
                        {"--state", state.empty() ? "" : state + ".frames"},
                        {"--events", zone_files.events},
                        {"--counts", zone_files.counts},
                        {"--heat-map", zone_files.heat_map}});
}

zones::ZonePlan TrackCommand::zone_plan(const pipeline::FrameSource& frames) const {
  const zones::ZonePlan plan = zones::read_zone_plan(zones);
  if (!frames.live() && !(frames.frame_rate() > 0)) {
    throw std::invalid_argument(
        input +
        ": how many frames a second it has is not known, and --zones counts in seconds; "
        "expected a video, or a sequence whose seqinfo.ini has a frameRate");
  }
  const auto picture = pipeline::picture_size(input);
  if (picture.width > 0) return plan.in_picture(picture.width, picture.height);
  if (plan.width > 0) return plan;
  throw std::invalid_argument(zones + ": the size of the input's picture is not known; expected " +
                              "\"picture\": [width, height]");
}

void TrackCommand::check_state(const pipeline::FrameSource& frames) const {
  if (state.empty()) return;
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("--state cannot go on with " + what);
  };
  for (const auto& file : {output, jsonl, json, zone_files.events, zone_files.counts}) {
    if (file == "-") refuse("standard output: what was printed is gone; expected a file");
  }
  if (!explain.empty()) refuse("--explain");
  if (!detections.every.empty()) refuse("--detect-every");
  if (moving_camera) refuse("--moving-camera");
  if (!render.empty() && !frames.repeatable()) refuse("--render of a camera or stream");
}

// What makes two runs the same, beside the options and the model, which the snapshot knows.
std::string TrackCommand::run_name() const {
  return pipeline::display_name(input) + " with boxes of " +
         (detections.detector.empty() ? detections.detections : detections.detector);
}

void TrackCommand::check_embeddings(pipeline::DetectionSource& boxes) const {
  if (!tracker.uses_appearance() || boxes.descriptor() == nullptr) return;
  if (!tracker.options.appearance.tau_a) {
    throw std::invalid_argument(
        "the boxes bring embeddings along, whose threshold is not known: expected --tau-a T (two "
        "are one person when 1 - distance exceeds T), or --no-appearance");
  }
  if (tracker.options.boosting.enabled) {
    throw std::invalid_argument(
        "--boosting looks for people by our own network, and the boxes bring embeddings of another "
        "along; expected one of the two");
  }
}

void TrackCommand::check_images(const pipeline::FrameSource& frames,
                                pipeline::DetectionSource& boxes) const {
  if (frames.has_images()) return;
  if (boxes.needs_images()) {
    throw std::invalid_argument(input +
                                ": the sequence has no frames, and the people detector "
                                "looks at them; give --detections FILE");
  }
  if (tracker.uses_appearance() && boxes.descriptor() == nullptr) {
    throw std::invalid_argument(input +
                                ": the sequence has no frames, and appearance looks at "
                                "them; track by motion with --no-appearance");
  }
  if (moving_camera) {
    throw std::invalid_argument(input + ": the sequence has no frames to see --moving-camera by");
  }
  if (!render.empty()) {
    throw std::invalid_argument(input + ": the sequence has no frames to draw on for --render");
  }
}

void TrackCommand::report(const pipeline::RunReport& report) const {
  note("{}", run_summary(report));
  if (stats) say(stdout, "{}", stage_table(report));
}

void TrackCommand::run() const {
  check_wanted();
  // Open: until here a signal ends the process at once, whatever an input waits for.
  const auto frames = live.open(input, detections.look_at_frames(), warn);
  const auto boxes = detections.open(input);
  const StopSignal stop;

  // Check: everything that can be wrong is found before the work begins.
  track::TrackerOptions options = tracker.options;
  options.validate();
  check_images(*frames, *boxes);
  check_embeddings(*boxes);
  check_state(*frames);
  check_outputs(*boxes);
  for (const auto& note : frames->notes()) warn(note);
  if (!boxes->file().empty() && !frames->numbering().empty()) warn(frames->numbering());
  for (const auto& note : pipeline::fit_to_scores(options, *boxes)) warn(note);
  mot::Sequence sequence;
  if (mot::Sequence::is_sequence(input)) sequence = mot::Sequence::read(input);
  const std::string odd = boxes->implausibility(sequence.width, sequence.height);
  if (!odd.empty()) warn(boxes->file().string() + ": " + odd);

  const bool given = tracker.uses_appearance() && boxes->descriptor() != nullptr;
  const auto loaded = given ? nullptr : tracker.load_appearance(warn);
  track::Tracker engine(options, given ? boxes->descriptor() : loaded.get());
  Outputs outputs(*this, *frames, engine);

  image::CameraMotionEstimator camera;
  std::optional<pipeline::RunState> kept;
  if (!state.empty()) kept.emplace(state, run_name(), state_every);
  pipeline::RunReport run;
  {
    Progress progress("tracking", frames->frame_count(), "frames");
    pipeline::RunObservers observers;
    observers.read = [&](const pipeline::Frame& frame) {
      outputs.read(frame);
      progress.update(frame.number, live_note(*frames));
    };
    observers.finished = [&](const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
      outputs.write(frame, time);
    };
    observers.warning = warn;
    observers.stop = [&] { return stop.requested(); };
    observers.unreadable = &outputs.unreadable();
    observers.state = kept ? &*kept : nullptr;
    observers.camera = moving_camera ? &camera : nullptr;
    const bool images = loaded != nullptr || outputs.need_images();
    run = pipeline::run_sequence(*frames, *boxes, engine, images, observers);
  }
  if (run.camera_lost > 0) {
    warn(
        fmt::format("how the camera moved could not be found in {} of {} frames; it was taken to "
                    "stand still there",
                    run.camera_lost, run.stats.frames));
  }
  outputs.commit(run);
  report(run);
  if (outputs.zones() != nullptr) {
    say(jsonl == "-" ? stderr : stdout, "{}", zone_counts_text(outputs.zones()->counter()));
  }
  if (run.failure != nullptr) std::rethrow_exception(run.failure);
  if (stop.requested() || run.boxes_ended) return;
  if (kept) kept->remove();
  if (frames->endless() || (run.ended_early && !frames->repeatable())) {
    throw std::runtime_error(
        fmt::format("{}: gives no more frames; the {} that it gave are written",
                    pipeline::display_name(input), run.stats.frames));
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
  sub->add_option("--output", command->output,
                  "Tracks as MOTChallenge result rows; - for standard output")
      ->type_name("FILE");
  add_detection_arguments(*sub, command->detections);
  add_live_arguments(*sub, command->live);
  sub->add_option("--jsonl", command->jsonl, "Finished frames as JSON lines; - for standard output")
      ->type_name("FILE");
  sub->add_option("--render", command->render,
                  "Video with the tracks drawn in (.mp4, .mkv, .mov, .avi)")
      ->type_name("FILE");
  sub->add_option("--rotate", command->rotate,
                  "Of a camera or stream: put files aside when they are as large or old as this, "
                  "100MB or 1h (videos: 10min) [never]")
      ->type_name("SIZE|TIME");
  sub->add_option("--json", command->json, "Counts and speed as JSON")->type_name("FILE");
  sub->add_option("--explain", command->explain,
                  "CSV of which tracks were joined, and why others were not")
      ->type_name("FILE");
  sub->add_option("--zones", command->zones,
                  "Count people who cross lines and stay in areas, JSON (docs/zones.md)")
      ->type_name("FILE");
  const auto add_zone_file = [&](const char* name, std::string& file, const char* help) {
    sub->add_option(name, file, help)->type_name("FILE")->needs("--zones");
  };
  add_zone_file("--events", command->zone_files.events,
                "What happened in the zones, a JSON object a line");
  add_zone_file("--counts", command->zone_files.counts, "Counts in all and by the hour, CSV");
  add_zone_file("--heat-map", command->zone_files.heat_map, "Where people stood how long, PNG");
  sub->add_flag("--moving-camera", command->moving_camera,
                "Find how the camera moves and take it out of the motion of people");
  sub->add_option("--state", command->state,
                  "Keep in FILE what a run that was killed goes on from, by the same command")
      ->type_name("FILE");
  sub->add_option("--state-every", command->state_every,
                  "Frames between two savings of the state, which a killed run does again")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  sub->add_flag("--stats", command->stats, "Print milliseconds by stage");
  add_tracker_arguments(*sub, command->tracker);
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
