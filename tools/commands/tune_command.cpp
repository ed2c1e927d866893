// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <stdexcept>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/tracker_arguments.h"
#include "report/tuning_text.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/output_file.h"
#include "sdmt/tuning/detection_embeddings.h"
#include "sdmt/tuning/tuning_json.h"
#include "sdmt/tuning/tuning_run.h"

namespace sdmt::tools {

namespace {

struct TuneOptions {
  tuning::TuningOptions tuning;
  std::vector<std::string> options;
  std::string output;
  std::string json;
  std::string state;
  TrackerArguments tracker;
};

// NAME=VALUE,VALUE,...
tuning::TunedOption parse_tuned_option(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) {
    throw std::invalid_argument("--option: " + io::quoted(text) +
                                ", expected NAME=VALUE,VALUE,...");
  }
  tuning::TunedOption option{text.substr(0, equals), {""}};
  for (const char letter : text.substr(equals + 1)) {
    if (letter == ',') {
      option.values.emplace_back();
    } else {
      option.values.back() += letter;
    }
  }
  return option;
}

void embed(const TuneOptions& options, tuning::TuningPlan& plan) {
  if (!options.tracker.uses_appearance()) return;
  const auto appearance = options.tracker.load_appearance(warning_of("tune"));
  Progress progress("embedding", plan.frames(), "frames");
  tuning::embed_detections(plan, *appearance, [&](int done) { progress.update(done); });
}

void run(const TuneOptions& options) {
  check_outputs(
      {{"--model", options.tracker.model}},
      {{"--output", options.output}, {"--json", options.json}, {"--state", options.state}});
  tuning::TuningOptions wanted = options.tuning;
  for (const auto& text : options.options) wanted.tuned.push_back(parse_tuned_option(text));
  tuning::TuningPlan plan = tuning::make_plan(wanted, options.tracker.options);
  embed(options, plan);
  const StopSignal stop;
  std::optional<eval::RunGrid> grid;
  {
    Progress progress("tuning", plan.runs(), "runs");
    grid = tuning::run_tuning(
        plan, options.state, [&](std::int64_t done) { progress.update(done); },
        [&] { return stop.requested(); });
  }
  if (!grid) {
    if (!options.state.empty()) note("the same command goes on from {}\n", options.state);
    return;
  }
  const tuning::TuningResult result = tuning::tuning_result(plan, *grid);
  note("{}", tuning_text(result));
  if (!options.json.empty()) io::write_text_file(options.json, tuning::tuning_json(result));
  if (!options.output.empty()) {
    io::write_text_file(options.output, tuning::preset_json(result.chosen));
  }
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
      ->add_option("--sequences", options->tuning.sequences,
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
      ->add_option("--settings", options->tuning.settings,
                   "Most settings to run; of more combinations so many are drawn")
      ->check(CLI::Range(1, tuning::TuningOptions::kMostSettings))
      ->capture_default_str();
  command
      ->add_option("--draws", options->tuning.draws,
                   "Runs of a setting over a sequence: with all boxes, and with some left out")
      ->check(CLI::Range(1, tuning::TuningOptions::kMostDraws))
      ->capture_default_str();
  command->add_option("--drop", options->tuning.drop, "Share of boxes left out")
      ->check(CLI::Range(0.0, tuning::TuningOptions::kMostDrop))
      ->capture_default_str();
  command->add_option("--seed", options->tuning.seed, "Of the draws and settings")
      ->capture_default_str();
  add_tracker_arguments(*command, options->tracker);
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
