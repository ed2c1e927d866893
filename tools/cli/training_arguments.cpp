// SPDX-License-Identifier: Apache-2.0
#include "cli/training_arguments.h"

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "cli/named_values.h"

namespace sdmt::tools {

namespace {

std::optional<train::BlockGrid> parse_tie(const std::string& text) {
  if (text == "none") return std::nullopt;
  train::BlockGrid grid;
  std::size_t used = 0;
  try {
    grid.rows = std::stoi(text, &used);
    if (used < text.size() && text[used] == 'x') {
      const std::string rest = text.substr(used + 1);
      grid.columns = std::stoi(rest, &used);
      if (used == rest.size()) return grid;
    }
  } catch (const std::logic_error&) {
    // not a number: reported below
  }
  throw std::invalid_argument("--tie is '" + text +
                              "', expected ROWSxCOLUMNS, such as 8x2, or none");
}

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
      .add_option("--unlabelled-batch", a.trainer.unlabelled_batch,
                  "Images without identities in a batch, beside those of people")
      ->capture_default_str();
  command.add_option("--data-weights", a.trainer.source_weights,
                     "Share of each --data in a batch [as many as it has people]");
  command
      .add_option("--holdout-ids", a.data.holdout_identities,
                  "People of each --data kept out to validate on")
      ->capture_default_str();
  command.add_option("--validate", a.data.validation_folders,
                     "Data set to validate on (query and gallery); several at once");
  command
      .add_option("--validate-every", a.trainer.validate_every, "Iterations between validations")
      ->capture_default_str();
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
  command
      .add_option_function<std::string>(
          "--tie", [&a](const std::string& text) { a.trainer.tie = parse_tie(text); },
          "Blocks of the map that share FC1's weights, or none [8x2]")
      ->type_name("ROWSxCOLUMNS");
  command.add_option("--storage", a.storage, "Of the weights: float32, float16 or int8 [float32]")
      ->transform(by_name<reid::Storage>({{"float32", reid::Storage::float32},
                                          {"float16", reid::Storage::float16},
                                          {"int8", reid::Storage::int8}}))
      ->type_name("NAME");
}

void add_teacher_options(CLI::App& command, TrainingArguments& a) {
  command
      .add_option("--teacher", a.data.teachers,
                  "Vectors of another network for all images, as `sdmt embed` writes them; several "
                  "files together are one teacher")
      ->type_name("FILE");
  command
      .add_option("--teacher-match", a.trainer.teacher_match,
                  "projection: the teacher's vectors, in their principal axes where they have more "
                  "dimensions; relations: dot products of the images of a batch [projection]")
      ->transform(by_name<train::TeacherMatch>({{"projection", train::TeacherMatch::projection},
                                                {"relations", train::TeacherMatch::relations}}))
      ->type_name("NAME");
  command.add_option("--teacher-weight", a.trainer.teacher_weight, "Of the teacher's loss")
      ->capture_default_str();
}

void add_optimisation_options(CLI::App& command, train::TrainerOptions& o) {
  command.add_option("--iterations", o.iterations)->capture_default_str();
  command.add_option("--identities", o.identities, "People in a batch (P)")->capture_default_str();
  command.add_option("--instances", o.instances, "Images of each (K)")->capture_default_str();
  command.add_option("--loss", o.loss.kind, "contrastive or triplet [contrastive]")
      ->transform(by_name<train::LossKind>(
          {{"contrastive", train::LossKind::contrastive}, {"triplet", train::LossKind::triplet}}))
      ->type_name("NAME");
  command.add_option("--margin", o.loss.margin)->capture_default_str();
  command.add_option("--triplet-scale", o.loss.triplet_scale)->capture_default_str();
  command.add_option("--optimizer", o.optimizer, "adam or sgd [adam]")
      ->transform(by_name<train::OptimizerKind>(
          {{"adam", train::OptimizerKind::adam}, {"sgd", train::OptimizerKind::sgd}}))
      ->type_name("NAME");
  command.add_option("--lr", o.learning_rate, "Learning rate of the head")->capture_default_str();
  command.add_option("--trunk-lr-scale", o.trunk_lr_scale, "The trunk's, relative to the head's")
      ->capture_default_str();
  command.add_option("--momentum", o.momentum, "Of sgd")->capture_default_str();
  command.add_option("--weight-decay", o.weight_decay)->capture_default_str();
  command.add_option("--clip-norm", o.clip_norm, "Largest gradient norm [no limit]");
  command.add_option("--schedule", o.decay, "cosine, exponential or constant [cosine]")
      ->transform(
          by_name<nn::LearningRateDecay>({{"cosine", nn::LearningRateDecay::cosine},
                                          {"exponential", nn::LearningRateDecay::exponential},
                                          {"constant", nn::LearningRateDecay::constant}}))
      ->type_name("NAME");
  command.add_option("--decay-start", o.decay_start, "Fraction of the iterations")
      ->capture_default_str();
  command.add_option("--final-lr", o.final_factor, "Last learning rate, relative to the first")
      ->capture_default_str();
  command.add_option("--warmup", o.warmup_iterations, "Iterations")->capture_default_str();
  command
      .add_option("--average", o.average,
                  "Moving average of the weights, validated and saved in their place: what a step "
                  "keeps of it, such as 0.999; 0: none")
      ->capture_default_str();
  command.add_option("--seed", o.seed)->capture_default_str();
}

void add_augmentation_options(CLI::App& command, train::TrainerOptions& o) {
  train::AugmentationOptions& a = o.augmentation;
  command
      .add_option("--views", o.views,
                  "Ways to look at each image, computed once through the frozen layers; 0: anew in "
                  "each iteration")
      ->capture_default_str();
  const auto add = [&command](const char* name, double& value, const char* help) {
    command.add_option(name, value, help)->capture_default_str();
  };
  add("--flip", a.flip, "Probability of a mirror image");
  add("--translate", a.translate, "Shift of the box, fraction of its size");
  add("--scale", a.scale, "Change of the box's size, fraction");
  add("--brightness", a.brightness, "Gain of all channels, up to 1 + this");
  add("--contrast", a.contrast, "Change of contrast, fraction");
  add("--tint", a.tint, "Gain of single channels, fraction");
  add("--saturation", a.saturation, "Change of saturation, fraction");
  add("--grey", a.grey, "Probability of losing all colour");
  add("--low-resolution", a.low_resolution, "Probability of a lower resolution");
  add("--blur", a.blur, "Probability of a blur");
  add("--erase", a.erase, "Probability of an erased rectangle");
  add("--crop", a.crop, "Probability of losing up to a third of the height");
  add("--gamma", a.gamma, "Power of the values, up to 1 + this");
  add("--offset", a.offset, "Added to all channels, fraction of their range");
  add("--grey-patch", a.grey_patch, "Probability of a rectangle without colour");
  add("--noise", a.noise, "Largest deviation of noise, of 255");
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
  add_teacher_options(command, arguments);
  add_optimisation_options(command, arguments.trainer);
  add_augmentation_options(command, arguments.trainer);
  add_file_options(command, arguments);
}

}  // namespace sdmt::tools
