// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "ablation/ablation.h"
#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/tracker_arguments.h"
#include "evaluation/scoring_arguments.h"
#include "sdmt/io/output_file.h"

namespace sdmt::tools {

namespace fs = std::filesystem;

namespace {

struct AblateOptions {
  std::vector<std::string> sequences;
  std::vector<std::string> variants;
  std::string detections = "det.txt";
  std::string calibration = "none";
  std::string model;
  bool amodal = false;
  ScoringArguments scoring;
};

AblationSequence load_sequence(const fs::path& folder, const std::string& detections) {
  AblationSequence input;
  input.sequence = mot::Sequence::read(folder);
  input.gt = eval::read_sequence_ground_truth(folder);
  input.detections = mot::DetectionFile::read(folder / "det" / detections);
  return input;
}

std::vector<AblationSequence> load_sequences(const AblateOptions& options) {
  std::vector<AblationSequence> inputs;
  for (const auto& path : options.sequences) {
    for (const auto& folder : eval::find_sequences(path)) {
      inputs.push_back(load_sequence(folder, options.detections));
      const auto& name = inputs.back().gt.name;
      const auto same = [&](const AblationSequence& other) { return other.gt.name == name; };
      if (std::count_if(inputs.begin(), inputs.end(), same) > 1) {
        throw std::invalid_argument(fmt::format("sequence {} is given twice", name));
      }
    }
  }
  return inputs;
}

// Ground truth with classes follows MOT16's rules, without MOT15's.
eval::Benchmark choose_benchmark(const AblateOptions& options,
                                 const std::vector<AblationSequence>& inputs) {
  if (!options.scoring.benchmark.empty()) return eval::parse_benchmark(options.scoring.benchmark);
  const bool has_classes = std::any_of(inputs.begin(), inputs.end(), [](const auto& input) {
    return !input.gt.rows.empty() && input.gt.rows.front().category > 0;
  });
  return has_classes ? eval::Benchmark::mot16 : eval::Benchmark::mot15;
}

// The variants asked for, in the table's order; all when none is named.
std::vector<AblationVariant> choose_variants(const AblateOptions& options) {
  auto variants = ablation_variants(track::parse_calibration(options.calibration), options.amodal);
  if (options.variants.empty()) return variants;
  const auto& asked = options.variants;
  std::vector<AblationVariant> chosen;
  std::string known;
  for (const auto& variant : variants) {
    known += fmt::format("{}'{}'", known.empty() ? "" : ", ", variant.name);
    if (std::find(asked.begin(), asked.end(), variant.name) != asked.end()) {
      chosen.push_back(variant);
    }
  }
  for (const auto& name : asked) {
    const auto has_name = [&](const AblationVariant& variant) { return variant.name == name; };
    if (std::none_of(chosen.begin(), chosen.end(), has_name)) {
      throw std::invalid_argument(
          fmt::format("--variants: there is no '{}', expected some of {}", name, known));
    }
  }
  return chosen;
}

// Null when no variant can use it.
std::unique_ptr<image::CropDescriptor> load_network(const AblateOptions& options,
                                                    const std::vector<AblationVariant>& variants,
                                                    const std::vector<AblationSequence>& inputs) {
  const bool wanted = std::any_of(variants.begin(), variants.end(), [](const auto& variant) {
    return variant.appearance == VariantAppearance::network;
  });
  const bool all_have_images = std::all_of(
      inputs.begin(), inputs.end(), [](const auto& input) { return input.sequence.has_images(); });
  if (!wanted || !all_have_images) return nullptr;
  return load_network_appearance(options.model, warning_of("ablate"));
}

void run(const AblateOptions& options) {
  check_outputs({{"--model", options.model}},
                {{"--json", options.scoring.json}, {"--report", options.scoring.report}});
  const auto variants = choose_variants(options);
  AblationRun run;
  run.compat = eval::parse_compat(options.scoring.compat);
  run.detections = options.detections;
  const auto inputs = load_sequences(options);
  run.benchmark = choose_benchmark(options, inputs);
  const auto network = load_network(options, variants, inputs);
  std::int64_t total = 0;
  for (const auto& input : inputs) total += input.gt.num_frames;
  for (const auto& variant : variants) {
    Progress progress(variant.name, total, "frames");
    run.rows.push_back(run_variant(
        variant, inputs, network.get(), run, [&](int frames) { progress.update(frames); },
        warning_of("ablate")));
  }
  say(stdout, "{} sequence{}, {} frames, {}, {} rules, counted as {}\n{}", inputs.size(),
      inputs.size() == 1 ? "" : "s", total, run.detections, eval::to_string(run.benchmark),
      counted_as(run.compat), to_text(run));
  write_json_file(options.scoring.json, to_json(run));
  if (!options.scoring.report.empty())
    io::write_text_file(options.scoring.report, ablation_html(run));
}

}  // namespace

void add_ablate_command(CLI::App& app) {
  auto options = std::make_shared<AblateOptions>();
  CLI::App* command = app.add_subcommand(
      "ablate", "Compare the paper's variants, SORT and the tuned tracker on sequences");
  command
      ->add_option("--sequences", options->sequences,
                   "MOT sequence folders, or folders of them; rows that use appearance need "
                   "frames in all of them")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--variants", options->variants,
                   "Only these rows, named as in the table, such as tuned or 'lambda=0' [all]")
      ->type_name("NAME");
  command->add_option("--detections", options->detections, "File in each sequence's det/")
      ->capture_default_str()
      ->type_name("NAME");
  command
      ->add_option("--calibration", options->calibration,
                   "Of the detector's scores, for the tuned rows: none, frcnn, acf, synthetic or "
                   "MIDPOINT,SCALE")
      ->capture_default_str()
      ->type_name("NAME");
  command->add_option("--model", options->model, "Embedding network [the shipped one]")
      ->type_name("FILE");
  command->add_flag(
      "--amodal", options->amodal,
      "The tuned rows, the online one and ByteTrack smoothed report people whole where "
      "the picture's border cuts them, as MOT16, MOT17 and MOT20 annotate them");
  add_scoring_arguments(*command, options->scoring,
                        "Whose rules apply [MOT16 where the ground truth has classes, else MOT15]");
  command->callback([options] { run(*options); });
}

}  // namespace sdmt::tools
