// SPDX-License-Identifier: Apache-2.0
#include "cli/training_arguments.h"

#include <limits>

#include "cli/named_values.h"
#include "cli/table_option.h"
#include "sdmt/train/trainer_option_table.h"

namespace sdmt::tools {

namespace {

void add_data_options(CLI::App& command, TrainingArguments& a) {
  command
      .add_option("--data", a.data.folders,
                  "Data set in Market-1501's layout, or a folder of its images; several at once, "
                  "their people taken to be different")
      ->required();
  command.add_option("--unlabelled", a.data.unlabelled_folders,
                     "Folder of images without identities, which learn from the teacher only; "
                     "several at once");
  command
      .add_option("--teacher", a.data.teachers,
                  "Vectors of another network for all images, as `sdmt embed` writes them; several "
                  "files together are one teacher")
      ->type_name("FILE");
  command.add_option("--data-weights", a.trainer.source_weights,
                     "Share of each --data in a batch [as many as it has people]");
  command
      .add_option("--holdout-ids", a.data.holdout_identities,
                  "People of each --data kept out to validate on")
      ->capture_default_str();
  command.add_option("--validate", a.data.validation_folders,
                     "Data set to validate on (query and gallery); several at once");
}

void add_model_options(CLI::App& command, TrainingArguments& a) {
  command.add_option("--output", a.output, "Model file to write")->required();
  auto* architecture =
      command
          .add_option("--architecture", a.architecture,
                      "vgg16 (the paper's), lite, or a file that describes a network")
          ->type_name("NAME|FILE.json")
          ->capture_default_str();
  auto* trunk = command.add_option("--trunk", a.trunk,
                                   "Pre-trained trunk, for vgg16 a VGG-16 with torchvision's names "
                                   "[random weights]");
  command.add_option("--model", a.model, "Model to go on from, trunk and head")
      ->excludes(trunk)
      ->excludes(architecture);
  auto* freeze =
      command.add_flag("--freeze-trunk", a.freeze_trunk, "Train the head only, on cached features");
  command
      .add_option("--unfreeze", a.unfreeze,
                  "First layer to train, such as conv3_1; those before stay as they are")
      ->excludes(freeze);
  command
      .add_option("--head", a.head,
                  "metric, or pair-classifier: the paper's other network, a baseline for "
                  "validate-roc --pair-classifier, always on the frozen trunk, without checkpoints")
      ->check(CLI::IsMember({"metric", "pair-classifier"}))
      ->capture_default_str();
  command.add_option("--storage", a.storage, "Of the weights: float32, float16 or int8 [float32]")
      ->transform(by_name<reid::Storage>({{"float32", reid::Storage::float32},
                                          {"float16", reid::Storage::float16},
                                          {"int8", reid::Storage::int8}}))
      ->type_name("NAME");
}

void add_file_options(CLI::App& command, TrainingArguments& a) {
  command.add_option("--checkpoint", a.checkpoint, "File of checkpoints [OUTPUT.checkpoint]");
  command.add_option("--checkpoint-every", a.checkpoint_every, "Iterations")
      ->check(CLI::Range(std::int64_t{1}, std::numeric_limits<std::int64_t>::max()))
      ->capture_default_str();
  command.add_option("--resume", a.resume, "Checkpoint to go on from, bit for bit");
  command.add_option("--log", a.log, "CSV file, one row an iteration");
  command.add_option("--feature-cache", a.feature_cache,
                     "Keep the features in this file, and take them from it when it exists");
  command.add_option("--json", a.json, "Result as JSON");
}

}  // namespace

void add_training_options(CLI::App& command, TrainingArguments& arguments) {
  add_data_options(command, arguments);
  add_model_options(command, arguments);
  add_file_options(command, arguments);
  for (const auto& entry : train::trainer_option_table()) {
    add_table_option(command, arguments.trainer, entry)->group("Training: " + entry.group);
  }
}

}  // namespace sdmt::tools
