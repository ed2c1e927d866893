// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <exception>
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
#include "report/run_report_text.h"
#include "report/zone_counts_text.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/mot/sequence.h"
#include "sdmt/pipeline/detection_source.h"
#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/line_output.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "tracking/track_outputs.h"
#include "tracking/track_run.h"

namespace sdmt::tools {

void TrackCommand::check_wanted() const {
  if (output.empty() && jsonl.empty() && render.empty() && json.empty() && zones.empty() &&
      !stats && serve.empty() && mqtt.url.empty()) {
    throw std::invalid_argument(
        "nothing to do: give --output, --jsonl, --render, --zones, --json, --stats, --serve or "
        "--mqtt");
  }
}

void TrackCommand::check_outputs(const pipeline::DetectionSource& boxes) const {
  std::vector<NamedPath> outputs;
  for_each_output(*this, [&](const char* option, const std::string& file) {
    outputs.push_back({option, file});
  });
  if (!state.empty()) outputs.push_back({"--state", state + ".frames"});
  tools::check_outputs({{"INPUT", input},
                        {"--detections", boxes.file()},
                        {"--detector", detections.detector},
                        {"--model", tracker.model},
                        {"--zones", zones}},
                       outputs);
}

zones::ZonePlan TrackCommand::zone_plan(const pipeline::FrameSource& frames) const {
  const zones::ZonePlan plan = zones::read_zone_plan(zones);
  if (!frames.live() && !(frames.frame_rate() > 0)) {
    throw std::invalid_argument(
        input +
        ": how many frames a second it has is not known, and --zones counts in seconds; "
        "expected a video, or a sequence whose seqinfo.ini has a frameRate");
  }
  const auto picture = pipeline::picture_size(frames, input);
  if (picture.width > 0) return plan.in_picture(picture.width, picture.height);
  if (plan.width > 0) return plan;
  throw std::invalid_argument(zones + ": the size of the input's picture is not known; expected " +
                              "\"picture\": [width, height]");
}

double TrackCommand::keep_seconds() const {
  const double seconds = pipeline::Rotation::parse(keep, "--keep").seconds;
  if (!(seconds > 0)) io::refuse_value("--keep", io::quoted(keep), "a time, as 7d (s, min, h, d)");
  return seconds;
}

void TrackCommand::check_no_store() const {
  if (!no_store) return;
  const auto refuse = [](const char* option, const char* what) {
    throw std::invalid_argument(std::string(option) + " keeps " + what +
                                ", expected none with --no-store");
  };
  if (!render.empty()) refuse("--render", "pictures");
  if (!state.empty()) refuse("--state", "the vectors of people");
  // Nor does the memory of a process that fails.
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  prctl(PR_SET_DUMPABLE, 0);
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
  if (!zones.empty() && frames.live()) refuse("--zones of a camera or stream");
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
  note("{}{}", prefix(), run_summary(report));
  if (stats) say(stdout, "{}{}", prefix(), stage_table(report));
}

void TrackCommand::run_one(const Appearances& appearances,
                           const std::function<bool()>& asked_to_stop,
                           const Followers& followers) const {
  const auto warn = [this](const std::string& text) { this->warn(text); };
  check_wanted();
  check_no_store();
  if (!keep.empty()) keep_seconds();
  // Open: until here a signal ends the process at once, whatever an input waits for.
  const auto frames = boxes_alone() ? pipeline::open_frame_source(input)
                                    : live.open(input, detections.look_at_frames(), warn);
  const auto boxes = detections.open(input);
  std::optional<StopSignal> own;
  if (!asked_to_stop) own.emplace();
  const auto stopped = [&] { return own ? own->requested() : asked_to_stop(); };

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
  pipeline::fit_to_picture(options, *frames, input);
  mot::Sequence sequence;
  if (mot::Sequence::is_sequence(input)) sequence = mot::Sequence::read(input);
  const std::string odd = boxes->implausibility(sequence.width, sequence.height);
  if (!odd.empty()) warn(boxes->file().string() + ": " + odd);

  const bool given = tracker.uses_appearance() && boxes->descriptor() != nullptr;
  const auto loaded = given ? nullptr : appearances ? appearances() : tracker.load_appearance(warn);
  track::Tracker engine(options, given ? boxes->descriptor() : loaded.get());
  Outputs outputs(*this, *frames, engine, followers);

  image::CameraMotionEstimator motion;
  std::optional<pipeline::RunState> kept;
  if (!state.empty()) kept.emplace(state, run_name(), state_every);
  pipeline::RunReport run;
  {
    std::optional<Progress> progress;
    if (camera.empty()) progress.emplace("tracking", frames->frame_count(), "frames");
    pipeline::RunObservers observers;
    observers.read = [&](const pipeline::Frame& frame) {
      outputs.read(frame);
      if (progress) progress->update(frame.number, live_note(*frames));
    };
    observers.finished = [&](const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
      outputs.write(frame, time);
    };
    observers.progress = [&](const pipeline::RunReport& so_far) { outputs.progress(so_far); };
    observers.warning = warn;
    observers.stop = stopped;
    observers.unreadable = &outputs.unreadable();
    observers.state = kept ? &*kept : nullptr;
    observers.camera = moving_camera ? &motion : nullptr;
    if (auto* log = outputs.explanation()) {
      observers.camera_moved = [log](int frame, const auto& moved) { log->camera(frame, moved); };
    }
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
    say(jsonl == "-" ? stderr : stdout, "{}{}", prefix(),
        zone_counts_text(outputs.zones()->counter()));
  }
  if (run.failure != nullptr) std::rethrow_exception(run.failure);
  if (stopped() || run.boxes_ended) return;
  if (kept) kept->remove();
  if (frames->endless() || (run.ended_early && !frames->repeatable())) {
    throw std::runtime_error(
        fmt::format("{}: gives no more frames; the {} that it gave are written",
                    pipeline::display_name(input), run.stats.frames));
  }
}

void add_track_command(CLI::App& app) {
  auto command = std::make_shared<TrackCommand>();
  CLI::App* sub =
      app.add_subcommand("track", "Track pedestrians through a video or image sequence");
  sub->add_option(
         "input", command->inputs,
         "MOT sequence folder, image folder, video file, camera:N, rtsp:// URL, or - for a video "
         "from standard input; several "
         "with --output-dir")
      ->required()
      ->expected(1, 64)
      ->type_name("INPUT");
  sub->add_option("--output", command->output,
                  "Tracks as MOTChallenge result rows; - for standard output")
      ->type_name("FILE");
  add_detection_arguments(*sub, command->detections);
  add_live_arguments(*sub, command->live);
  add_mqtt_arguments(*sub, command->mqtt);
  sub->add_option("--output-dir", command->output_dir,
                  "Folder of a folder for each input, in which its outputs have the names that "
                  "their options say [--output tracks.txt]")
      ->type_name("DIR");
  sub->add_option("--jsonl", command->jsonl, "Finished frames as JSON lines; - for standard output")
      ->type_name("FILE");
  sub->add_option("--render", command->render,
                  "Video with the tracks drawn in (.mp4, .mkv, .mov, .avi)")
      ->type_name("FILE");
  sub->add_option("--rotate", command->rotate,
                  "Of a camera or stream: put files aside when they are as large or old as this, "
                  "100MB or 1h (videos: 10min) [never]")
      ->type_name("SIZE|TIME");
  sub->add_option("--keep", command->keep,
                  "Remove what --rotate put aside once it is as old as this, 7d [never]")
      ->type_name("TIME");
  sub->add_flag(
      "--no-store", command->no_store,
      "No picture and no vector of anybody reaches a disk or a socket: --serve shows none, "
      "--render and --state are refused");
  sub->add_flag("--blur", command->blur,
                "Make people unrecognisable in what --render and --serve show");
  sub->add_option("--serve", command->serve,
                  "Show pictures and state to browsers; PORT: on this machine alone")
      ->type_name("[ADDRESS:]PORT");
  sub->add_option("--serve-token", command->serve_token,
                  "What a viewer has to bring along, as ?token= or Authorization: Bearer")
      ->type_name("TOKEN")
      ->needs("--serve");
  sub->add_option("--json", command->json, "Counts and speed as JSON")->type_name("FILE");
  sub->add_option(
         "--explain", command->explain,
         "CSV of which tracks were joined, why others were not, what never became one, and how the "
         "camera moved")
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
