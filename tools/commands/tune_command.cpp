// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/tracker_arguments.h"
#include "tuning/tuning.h"

namespace sdmt::tools {

namespace fs = std::filesystem;

namespace {

struct TuneOptions {
  std::vector<std::string> sequences;
  std::vector<std::string> options;
  std::string output;
  std::string json;
  std::string state;
  int settings = 200;
  int draws = 4;
  double drop = 0.02;
  std::uint64_t seed = 1;
  TrackerArguments tracker;
};

// DIR, DIR=FILE or DIR=FILE@CALIBRATION: sequences with the detections det/FILE of each.
void add_sequences(const std::string& text, std::vector<TuningSequence>& sequences) {
  const auto equals = text.find('=');
  const std::string path = text.substr(0, equals);
  std::string detector = equals == std::string::npos ? "det.txt" : text.substr(equals + 1);
  std::string calibration = "none";
  if (const auto at = detector.find('@'); at != std::string::npos) {
    calibration = detector.substr(at + 1);
    detector.resize(at);
  }
  for (const auto& folder : eval::find_sequences(path)) {
    TuningSequence input;
    input.sequence = mot::Sequence::read(folder);
    input.gt = eval::read_sequence_ground_truth(folder);
    const bool classes = !input.gt.rows.empty() && input.gt.rows.front().category > 0;
    input.benchmark = classes ? eval::Benchmark::mot16 : eval::Benchmark::mot15;
    input.detector = detector;
    input.detections = mot::DetectionFile::read(folder / "det" / detector);
    input.calibration = track::parse_calibration(calibration);
    for (const TuningSequence& other : sequences) {
      if (other.gt.name == input.gt.name && other.detector == detector) {
        throw std::invalid_argument(
            fmt::format("sequence {} is given twice with {}", input.gt.name, detector));
      }
    }
    sequences.push_back(std::move(input));
  }
}

TuningPlan plan_of(const TuneOptions& options) {
  TuningPlan plan;
  for (const auto& text : options.options) {
    plan.tuned.push_back(parse_tuned_option(text));
    const auto& name = plan.tuned.back().name;
    const auto same = [&](const TunedOption& other) { return other.name == name; };
    if (std::count_if(plan.tuned.begin(), plan.tuned.end(), same) > 1) {
      throw std::invalid_argument(fmt::format("--option {} is given twice", name));
    }
    if (options.tracker.uses_appearance() && name == "boosting") {
      throw std::invalid_argument(
          "--option boosting: it looks at frames, and embeddings of boxes are stored instead");
    }
  }
  for (const auto& text : options.sequences) add_sequences(text, plan.sequences);
  plan.settings =
      tuning_settings(options.tracker.options, plan.tuned, options.settings, options.seed);
  plan.draws = options.draws;
  plan.drop = options.drop;
  plan.seed = options.seed;
  return plan;
}

void embed(const TuneOptions& options, TuningPlan& plan) {
  if (!options.tracker.uses_appearance()) return;
  const auto appearance = options.tracker.load_appearance(warning_of("tune"));
  plan.tau_a = options.tracker.options.appearance.tau_a ? options.tracker.options.appearance.tau_a
                                                        : appearance->tau_a();
  std::int64_t frames = 0;
  for (const auto& input : plan.sequences) {
    if (!input.sequence.has_images()) {
      throw std::invalid_argument(input.sequence.folder.string() +
                                  ": the sequence has no frames to see people on, expected some, "
                                  "or --appearance none");
    }
    frames += input.gt.num_frames;
  }
  Progress progress("embedding", frames, "frames");
  embed_detections(plan, *appearance, [&](int done) { progress.update(done); });
}

void run(const TuneOptions& options) {
  check_outputs(
      {{"--model", options.tracker.model}},
      {{"--output", options.output}, {"--json", options.json}, {"--state", options.state}});
  TuningPlan plan = plan_of(options);
  embed(options, plan);
  const StopSignal stop;
  std::optional<eval::RunGrid> grid;
  {
    const auto runs =
        (plan.settings.size() + 1) * plan.sequences.size() * static_cast<std::size_t>(plan.draws);
    Progress progress("tuning", static_cast<std::int64_t>(runs), "runs");
    grid = run_tuning(
        plan, options.state, [&](std::int64_t done) { progress.update(done); },
        [&] { return stop.requested(); });
  }
  if (!grid) {
    if (!options.state.empty()) note("the same command goes on from {}\n", options.state);
    return;
  }
  const auto found = tuning_json(plan, *grid);
  note("{} sequences, {} settings, {} draws\n{}", grid->sequences(), plan.settings.size(),
       plan.draws, tuning_text(found));
  write_json_file(options.json, found);
  write_json_file(options.output, tuned_preset(plan, *grid));
}

}  // namespace

void add_tune_command(CLI::App& app) {
  auto options = std::make_shared<TuneOptions>();
  options->tracker.appearance = "none";
  CLI::App* command = app.add_subcommand(
      "tune",
      "Choose the tracker's options on sequences with ground truth, and say what that "
      "brings on others");
  command
      ->add_option("--sequences", options->sequences,
                   "MOT sequence folders, or folders of them; with =FILE detections of another "
                   "file in det/ than det.txt, with =FILE@CALIBRATION scores read as --calibration "
                   "does")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--option", options->options,
                   "An option of the tracker with the values to try, NAME=VALUE,VALUE,...; may be "
                   "repeated")
      ->required()
      ->type_name("TEXT");
  command->add_option("--output", options->output, "The chosen options as a file for --config")
      ->type_name("FILE");
  command->add_option("--json", options->json, "What was found as JSON")->type_name("FILE");
  command
      ->add_option("--state", options->state,
                   "Keep finished runs in FILE, from which the same command goes on")
      ->type_name("FILE");
  command
      ->add_option("--settings", options->settings,
                   "Most settings to run; of more combinations so many are drawn")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  command
      ->add_option("--draws", options->draws,
                   "Runs of a setting over a sequence: with all boxes, and with some left out")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--drop", options->drop, "Share of boxes left out")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Of the draws and settings")->capture_default_str();
  add_tracker_arguments(*command, options->tracker);
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
