// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
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
  std::vector<std::string> data;
  ValidationCropOptions crops;
  std::vector<std::string> embeddings;  // NAME=FILE
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

// Several files of one name hold the vectors of one network.
std::vector<Contender> file_contenders(const std::vector<std::string>& embeddings) {
  std::vector<Contender> contenders;
  for (const std::string& entry : embeddings) {
    const auto equals = entry.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == entry.size()) {
      throw std::invalid_argument("--embeddings is '" + entry + "', expected NAME=FILE");
    }
    const std::string name = entry.substr(0, equals);
    auto at = std::find_if(contenders.begin(), contenders.end(),
                           [&](const Contender& contender) { return contender.name == name; });
    if (at == contenders.end()) {
      contenders.emplace_back().name = name;
      at = std::prev(contenders.end());
    }
    at->files.emplace_back(entry.substr(equals + 1));
  }
  return contenders;
}

std::string name_of(const fs::path& data) { return fs::weakly_canonical(data).filename().string(); }

std::vector<Contender> ValidateRocCommand::contenders(const fs::path& model_file,
                                                      std::size_t count) const {
  std::vector<Contender> contenders;
  contenders.push_back(embedding_contender(reid::load_model(model_file)));
  if (!pair_classifier.empty()) contenders.push_back(pair_classifier_contender(pair_classifier));
  if (baselines) {
    contenders.push_back(untrained_head_contender(reid::load_model(model_file), validation.seed));
    auto trunk = trunk_contender(reid::load_model(model_file));
    constexpr std::size_t kMostValues = 250'000'000;  // 1 GB
    if (count * static_cast<std::size_t>(trunk.descriptor->dimension()) <= kMostValues) {
      contenders.push_back(std::move(trunk));
    } else {
      say(stdout,
          "the baseline of trunk features is left out: {} images would take more than 1 GB\n",
          count);
    }
    contenders.push_back(color_histogram_contender());
  }
  // Last, as the boxes of a sequence go without them.
  for (Contender& contender : file_contenders(embeddings)) {
    contenders.push_back(std::move(contender));
  }
  return contenders;
}

DescribedCrops describe(const std::vector<ValidationCrop>& crops,
                        std::span<const Contender> contenders) {
  Progress progress("embedding", static_cast<std::int64_t>(crops.size()), "images");
  return describe_crops(crops, contenders, [&](std::int64_t done) { progress.update(done); });
}

void ValidateRocCommand::run() const {
  validation.validate();
  const fs::path model_file = model.empty() ? find_default_model() : fs::path(model);
  check_outputs({{"--model", model_file}, {"--pair-classifier", pair_classifier}},
                {{"--plot", plot}, {"--report", report}, {"--json", json}});
  if (write_threshold) check_outputs({}, {{"--model", model_file}});
  if (write_threshold && data.size() > 1) {
    throw std::invalid_argument(
        "--write-threshold chooses by one data set, expected one --data, not " +
        std::to_string(data.size()));
  }
  std::vector<std::vector<ValidationCrop>> listed;
  std::size_t most = 0;
  for (const std::string& folder : data) {
    ValidationCropOptions of_folder = crops;
    of_folder.data = folder;
    listed.push_back(list_validation_crops(of_folder));
    most = std::max(most, listed.back().size());
  }
  const auto all = contenders(model_file, most);
  const auto files = static_cast<std::size_t>(std::count_if(
      all.begin(), all.end(), [](const Contender& contender) { return !contender.descriptor; }));

  std::vector<ValidationScores> sets;
  std::vector<DescribedCrops> described;
  for (std::size_t i = 0; i < data.size(); ++i) {
    std::span<const Contender> here(all);
    if (listed[i].front().rect && files > 0) {
      here = here.first(all.size() - files);
      say(stdout, "{}: the boxes of a sequence have no rows in --embeddings, which are left out\n",
          name_of(data[i]));
    }
    described.push_back(describe(listed[i], here));
    for (const auto& path : described.back().unreadable) {
      say(stdout, "left out: {}\n", path.string());
    }
    const auto centred = static_cast<std::size_t>(std::count_if(
        here.begin(), here.end(),
        [&](const Contender& contender) { return validation.centre && !contender.distance; }));
    Progress progress("scoring", kScoringSteps * static_cast<std::int64_t>(here.size() + centred),
                      "steps");
    sets.push_back(score(described.back(), here, validation, name_of(data[i]),
                         [&](std::int64_t done) { progress.update(done); }));
  }
  say(stdout, "{}", to_text(sets));
  if (!plot.empty()) io::write_text_file(plot, validation_plot(sets));
  if (!report.empty()) {
    io::write_text_file(report, validation_report(sets, described, model_file.filename().string()));
  }
  write_json_file(json, to_json(sets));
  if (write_threshold) {
    const ThresholdChoice& chosen = sets.front().chosen;
    reid::ModelMetadata metadata = reid::load_model(model_file).metadata;
    metadata.tau_a = {chosen.tau_a, chosen.criterion, chosen.fpr};
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
  sub->add_option("--data", command->data,
                  "One or more: folder in the layout of Market-1501 (query, bounding_box_test), "
                  "folder of such images, or MOT sequence (its ground truth)")
      ->required()
      ->type_name("DIR");
  sub->add_option("--embeddings", command->embeddings,
                  "Also score the vectors that another network made of the images, a file as sdmt "
                  "embed writes it; may be repeated, files of one name belong together")
      ->allow_extra_args(false)
      ->type_name("NAME=FILE");
  sub->add_option("--distractors", command->crops.distractors,
                  "Folder of background images, beside those of pid 0000")
      ->type_name("DIR");
  sub->add_option("--frame-step", command->crops.frame_step, "Of a MOT sequence, every Nth frame")
      ->capture_default_str();
  add_frame_range(*sub, command->crops.frames, "Of a MOT sequence, only these frames [all]");
  sub->add_option("--pairs", command->validation.pairs,
                  "Pairs of each kind, a seeded sample [all pairs]");
  sub->add_option("--seed", command->validation.seed, "Of samples and intervals")
      ->capture_default_str();
  sub->add_option("--criterion", command->validation.criterion,
                  "How tau_a is chosen: largest accuracy, equal error rate, crossing of the "
                  "histograms, or --target-fpr")
      ->check(CLI::IsMember({"accuracy", "eer", "crossing", "fpr"}))
      ->capture_default_str();
  sub->add_option(
         "--target-fpr", command->validation.target_fpr,
         "Share of two people's pairs that may pass: for --criterion fpr, and the tau_a that it "
         "needs is printed")
      ->capture_default_str();
  sub->add_flag("--baselines", command->baselines,
                "Also score an untrained head, the trunk's features and a colour histogram");
  sub->add_flag("--centre", command->validation.centre,
                "Also score all vectors less the mean of their camera's");
  sub->add_flag("--write-threshold", command->write_threshold, "Store tau_a in the model file");
  sub->add_option("--plot", command->plot, "Write the plot here (SVG)")->type_name("FILE");
  sub->add_option("--report", command->report, "Write a report here (HTML)")->type_name("FILE");
  sub->add_option("--json", command->json, "Write the numbers here")->type_name("FILE");
  sub->callback([command] { command->run(); });
}

}  // namespace sdmt::tools
