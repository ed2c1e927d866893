// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/shipped_files.h"
#include "report/validation_report.h"
#include "sdmt/io/output_file.h"
#include "sdmt/reid/model_file.h"
#include "validation/contender.h"
#include "validation/described_crops.h"
#include "validation/validation.h"
#include "validation/validation_crops.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

struct ValidateRocCommand {
  std::string model;
  std::string pair_classifier;
  ValidationCropOptions crops;
  ValidationOptions validation;
  bool baselines = false;
  bool write_threshold = false;
  std::string plot;
  std::string report;
  std::string json;

  void run() const;

 private:
  std::vector<Contender> contenders(const fs::path& model_file, std::size_t count) const;
};

std::vector<Contender> ValidateRocCommand::contenders(const fs::path& model_file,
                                                      std::size_t count) const {
  std::vector<Contender> contenders;
  contenders.push_back(embedding_contender(reid::load_model(model_file)));
  if (!pair_classifier.empty()) contenders.push_back(pair_classifier_contender(pair_classifier));
  if (!baselines) return contenders;
  contenders.push_back(untrained_head_contender(reid::load_model(model_file), validation.seed));
  auto trunk = trunk_contender(reid::load_model(model_file));
  constexpr std::size_t kMostValues = 250'000'000;  // 1 GB
  if (count * static_cast<std::size_t>(trunk.descriptor->dimension()) <= kMostValues) {
    contenders.push_back(std::move(trunk));
  } else {
    say(stdout, "the baseline of trunk features is left out: {} images would take more than 1 GB\n",
        count);
  }
  contenders.push_back(color_histogram_contender());
  return contenders;
}

void ValidateRocCommand::run() const {
  validation.validate();
  const fs::path model_file = model.empty() ? find_default_model() : fs::path(model);
  check_outputs({{"--model", model_file}, {"--pair-classifier", pair_classifier}},
                {{"--plot", plot}, {"--report", report}, {"--json", json}});
  if (write_threshold) check_outputs({}, {{"--model", model_file}});
  const auto listed = list_validation_crops(crops);
  const auto described_by = contenders(model_file, listed.size());
  DescribedCrops described;
  {
    Progress progress("embedding", static_cast<std::int64_t>(listed.size()), "images");
    described =
        describe_crops(listed, described_by, [&](std::int64_t done) { progress.update(done); });
  }
  for (const auto& path : described.unreadable) say(stdout, "left out: {}\n", path.string());

  const auto data = fs::weakly_canonical(crops.data).filename().string();
  const auto scores = score(described, described_by, validation, data);
  say(stdout, "{}", to_text(scores));
  if (!plot.empty()) io::write_text_file(plot, validation_plot(scores));
  if (!report.empty()) {
    io::write_text_file(report,
                        validation_report(scores, described, model_file.filename().string()));
  }
  write_json_file(json, to_json(scores));
  if (write_threshold) {
    reid::ModelMetadata metadata = reid::load_model(model_file).metadata;
    metadata.tau_a = {scores.chosen.tau_a, scores.chosen.criterion, scores.chosen.fpr};
    reid::rewrite_metadata(model_file, metadata);
    say(stdout, "written to {}\n", model_file.string());
  }
}

}  // namespace

void add_validate_roc_command(CLI::App& app) {
  auto command = std::make_shared<ValidateRocCommand>();
  CLI::App* sub = app.add_subcommand(
      "validate-roc", "Measure how well a model tells people apart, and choose tau_a");
  sub->add_option("--model", command->model, "Model file [the shipped one]")->type_name("FILE");
  sub->add_option("--pair-classifier", command->pair_classifier,
                  "Also score a classifier made by train-embedder --head pair-classifier")
      ->type_name("FILE");
  sub->add_option("--data", command->crops.data,
                  "Folder in the layout of Market-1501 (query, bounding_box_test), folder of such "
                  "images, or MOT sequence (its ground truth)")
      ->required()
      ->type_name("DIR");
  sub->add_option("--distractors", command->crops.distractors,
                  "Folder of background images, beside those of pid 0000")
      ->type_name("DIR");
  sub->add_option("--frame-step", command->crops.frame_step, "Of a MOT sequence, every Nth frame")
      ->capture_default_str();
  sub->add_option("--pairs", command->validation.pairs,
                  "Pairs of each kind, a seeded sample [all pairs]");
  sub->add_option("--seed", command->validation.seed, "Of samples and intervals")
      ->capture_default_str();
  sub->add_option("--criterion", command->validation.criterion,
                  "How tau_a is chosen: largest accuracy, equal error rate, crossing of the "
                  "histograms, or --target-fpr")
      ->check(CLI::IsMember({"accuracy", "eer", "crossing", "fpr"}))
      ->capture_default_str();
  sub->add_option("--target-fpr", command->validation.target_fpr, "For --criterion fpr")
      ->capture_default_str();
  sub->add_flag("--baselines", command->baselines,
                "Also score an untrained head, the trunk's features and a colour histogram");
  sub->add_flag("--write-threshold", command->write_threshold, "Store tau_a in the model file");
  sub->add_option("--plot", command->plot, "Write the plot here (SVG)")->type_name("FILE");
  sub->add_option("--report", command->report, "Write a report here (HTML)")->type_name("FILE");
  sub->add_option("--json", command->json, "Write the numbers here")->type_name("FILE");
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
