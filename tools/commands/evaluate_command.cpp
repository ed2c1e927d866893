// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <system_error>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "evaluation/evaluation.h"
#include "evaluation/scoring_arguments.h"
#include "report/evaluation_report.h"
#include "report/event_report.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/plausibility.h"
#include "sdmt/mot/sequence.h"

namespace sdmt::tools {

namespace fs = std::filesystem;

namespace {

struct EvaluateOptions {
  std::vector<std::string> gt;
  std::vector<std::string> results;
  std::vector<std::string> sequences;
  ScoringArguments scoring{.benchmark = "MOT16"};
  bool allow_missing = false;
  std::string csv;
  bool explain = false;
  eval::EventOptions events;
  std::string render;
};

// Sequence folders by name; two of one name could not be told apart in a folder of results.
std::map<std::string, fs::path> find_ground_truth(const EvaluateOptions& options) {
  std::map<std::string, fs::path> folders;
  for (const auto& path : options.gt) {
    for (const auto& folder : eval::find_sequences(path)) {
      const auto name = eval::sequence_name(folder);
      const auto [other, is_new] = folders.emplace(name, folder);
      if (!is_new) {
        throw std::invalid_argument(fmt::format("sequence {} is found twice: {} and {}", name,
                                                other->second.string(), folder.string()));
      }
    }
  }
  if (options.sequences.empty()) return folders;
  std::map<std::string, fs::path> chosen;
  for (const auto& name : options.sequences) {
    const auto found = folders.find(name);
    if (found == folders.end()) {
      throw std::invalid_argument(fmt::format("sequence {} has no ground truth", name));
    }
    chosen.insert(*found);
  }
  return chosen;
}

// NAME.txt among the result files and folders; a single result file is that of a single sequence
// whatever its name. Empty: not there.
fs::path find_results(const EvaluateOptions& options, const std::string& name,
                      std::size_t num_sequences) {
  if (num_sequences == 1 && options.results.size() == 1 &&
      fs::is_regular_file(options.results.front())) {
    return options.results.front();
  }
  fs::path found;
  for (const fs::path path : options.results) {
    const auto candidate = fs::is_directory(path) ? path / (name + ".txt") : path;
    if (candidate.stem() != name || !fs::exists(candidate)) continue;
    if (!found.empty()) {
      throw std::invalid_argument(fmt::format("sequence {} has two result files: {} and {}", name,
                                              found.string(), candidate.string()));
    }
    found = candidate;
  }
  return found;
}

// Boxes in a wrong format score like those of a very bad tracker.
void warn_of_implausible(std::span<const mot::ResultRow> rows, const fs::path& folder,
                         const std::string& file) {
  std::vector<mot::Tlwh> boxes;
  for (const auto& row : rows) boxes.push_back(row.box);
  mot::Sequence sequence;
  if (mot::Sequence::is_sequence(folder)) sequence = mot::Sequence::read(folder);
  const auto text = mot::describe_implausible(boxes, sequence.width, sequence.height);
  if (!text.empty()) warning_of("evaluate")(file + ": " + text);
}

Evaluation evaluate(const EvaluateOptions& options) {
  Evaluation evaluation;
  evaluation.benchmark = eval::parse_benchmark(options.scoring.benchmark);
  evaluation.compat = eval::parse_compat(options.scoring.compat);
  const auto early = evaluation.compat == eval::Compat::devkit ? mot::RowsBeforeFrame1::drop
                                                               : mot::RowsBeforeFrame1::refuse;
  for (const auto& path : options.results) {
    if (!fs::exists(path)) throw std::invalid_argument(path + ": no such file or folder");
  }
  const auto folders = find_ground_truth(options);
  // A sequence that lacks its results is found before the long work starts.
  std::map<std::string, fs::path> files;
  for (const auto& [name, folder] : folders) {
    files[name] = find_results(options, name, folders.size());
    if (files[name].empty() && !options.allow_missing) {
      throw std::invalid_argument(
          fmt::format("sequence {0} has no results: no {0}.txt in {1} (--allow-missing scores it "
                      "as empty)",
                      name, fmt::join(options.results, ", ")));
    }
  }
  for (const auto& [name, folder] : folders) {
    const auto gt = eval::read_sequence_ground_truth(folder);
    std::vector<mot::ResultRow> rows;
    if (!files[name].empty()) rows = mot::read_results(files[name], early);
    warn_of_implausible(rows, folder, files[name].string());
    evaluation.sequences.push_back(evaluate_sequence(folder, gt, rows, files[name].string(),
                                                     evaluation.benchmark, evaluation.compat));
  }
  combine_sequences(evaluation);
  return evaluation;
}

std::vector<SequenceEvents> explain(const Evaluation& evaluation,
                                    const eval::EventOptions& options) {
  std::vector<SequenceEvents> all;
  for (const auto& sequence : evaluation.sequences) {
    all.push_back({&sequence, eval::find_events(sequence.prepared, sequence.matches, options)});
  }
  return all;
}

void make_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (!fs::is_directory(folder)) {
    throw std::invalid_argument(fmt::format("--render {}: the folder cannot be made: {}",
                                            folder.string(), failed.message()));
  }
}

void run(const EvaluateOptions& options) {
  options.events.validate();
  std::vector<NamedPath> inputs;
  for (const auto& path : options.results) inputs.push_back({"--results", path});
  check_outputs(inputs, {{"--json", options.scoring.json},
                         {"--csv", options.csv},
                         {"--report", options.scoring.report}});
  if (!options.render.empty()) make_folder(options.render);
  const auto evaluation = evaluate(options);
  say(stdout, "{}, counted as {}\n{}", eval::to_string(evaluation.benchmark),
      counted_as(evaluation.compat), to_text(evaluation));
  auto json = to_json(evaluation);
  if (options.explain || !options.render.empty()) {
    const auto events = explain(evaluation, options.events);
    if (options.explain) {
      say(stdout, "\n{}", to_text(events));
      json["events"] = to_json(events);
    }
    if (!options.render.empty()) {
      say(stdout, "{} frames drawn in {}\n", draw_events(events, options.render), options.render);
    }
  }
  write_json_file(options.scoring.json, json);
  if (!options.scoring.report.empty()) {
    const auto what = fmt::format("{}", fmt::join(options.results, ", "));
    io::write_text_file(options.scoring.report, evaluation_html(evaluation, what, options.events));
  }
  if (!options.csv.empty()) io::write_text_file(options.csv, to_csv(evaluation));
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  auto options = std::make_shared<EvaluateOptions>();
  CLI::App* command = app.add_subcommand("evaluate", "Score tracks against ground truth");
  command
      ->add_option("--gt", options->gt,
                   "Folder of sequences with gt/gt.txt, or one such sequence; may be repeated")
      ->required()
      ->allow_extra_args(false)
      ->type_name("DIR");
  command
      ->add_option("--results", options->results,
                   "Folder with a NAME.txt for each sequence, or such files; may be repeated")
      ->required()
      ->type_name("DIR|FILE");
  command->add_option("--sequences", options->sequences, "Only these sequences")->type_name("NAME");
  add_scoring_arguments(*command, options->scoring, "Whose rules apply");
  command->add_flag("--allow-missing", options->allow_missing,
                    "Score a sequence without a result file as if nothing had been found");
  command->add_option("--csv", options->csv, "Write a row of scores a sequence here")
      ->type_name("FILE");
  command->add_flag("--explain", options->explain,
                    "List every ID switch, long miss and false track with frame and box");
  command
      ->add_option("--long-miss", options->events.long_miss,
                   "A person missed for this many boxes on end is a long miss")
      ->capture_default_str()
      ->type_name("N");
  command
      ->add_option("--render", options->render,
                   "Draw the frames in which such events start into this folder (sequences "
                   "with images)")
      ->type_name("DIR");
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
