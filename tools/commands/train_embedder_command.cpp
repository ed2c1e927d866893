// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/console.h"
#include "cli/json_file.h"
#include "cli/named_values.h"
#include "cli/output_paths.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/pair_classifier.h"
#include "sdmt/train/trainer.h"
#include "sdmt/train/training_log.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Arguments {
  train::TrainingSetOptions data;
  train::TrainerOptions trainer;
  std::string output, architecture = "vgg16", trunk, model, unfreeze, tie = "8x2";
  std::string head = "metric";
  bool freeze_trunk = false;
  reid::Storage storage = reid::Storage::float32;
  std::string checkpoint, resume, log, feature_cache, json;
  std::int64_t checkpoint_every = 1000;
};

// Ends the caching of features, which has no other way out.
struct Stopped {};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

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

reid::Model starting_model(const Arguments& arguments) {
  if (!arguments.model.empty()) return reid::load_model(arguments.model);
  reid::Model model = reid::untrained_model(reid::find_architecture(arguments.architecture),
                                            arguments.trainer.seed);
  if (!arguments.trunk.empty()) {
    const auto ignored = reid::load_trunk(arguments.trunk, model.network);
    model.metadata.provenance = "trunk from " + fs::path(arguments.trunk).filename().string();
    if (!ignored.empty()) {
      say(stdout, "{}: {} tensors besides the trunk are ignored, the first is {}\n",
          arguments.trunk, ignored.size(), ignored.front());
    }
  }
  return model;
}

void describe(const train::TrainingSet& set, const Arguments& arguments,
              const train::Trainer& trainer) {
  say(stdout, "training on {} images of {} people\n", set.images.size(), set.identities.size());
  if (!set.unlabelled.empty()) {
    say(stdout, "{} of the images are nobody's in particular\n", set.unlabelled.size());
  }
  if (!set.teacher.empty()) {
    say(stdout, "taught by vectors of {} values", set.teacher.shape().c);
    if (trainer.teacher_kept() < 1) {
      say(stdout, ", of which the principal axes keep {:.1f} %", 100 * trainer.teacher_kept());
    }
    say(stdout, "\n");
  }
  for (const auto& validation : set.validation) {
    say(stdout, "validating on {}: {} images of {} people\n", validation.name,
        validation.images.size(), validation.labels.back() + 1);
  }
  for (const auto& path : set.unreadable) say(stdout, "left out, unreadable: {}\n", path.string());
  if (trainer.cache_bytes() > 0) {
    say(stdout, "features of {} views of each image take {} MiB {}\n", arguments.trainer.views,
        trainer.cache_bytes() >> 20,
        arguments.feature_cache.empty() ? "of memory" : "in " + arguments.feature_cache);
  }
}

std::string scores(const train::Validation& validation) {
  std::string text;
  for (const auto& [name, auc] : validation.auc) text += fmt::format("  {} {:.4f}", name, auc);
  return text;
}

// The training itself. Returns false when a signal ended it.
bool run(train::Trainer& trainer, const Arguments& arguments, const StopSignal& stop,
         nlohmann::ordered_json& report) {
  std::optional<train::TrainingLog> log;
  if (!arguments.log.empty()) {
    log.emplace(arguments.log, trainer.iteration(), !trainer.data().teacher.empty());
  }
  const double batch = arguments.trainer.identities * arguments.trainer.instances +
                       (trainer.data().unlabelled.empty() ? 0 : arguments.trainer.unlabelled_batch);
  const auto start = Clock::now();
  const auto first = trainer.iteration();
  double loss = 0;
  {
    Progress progress("training", arguments.trainer.iterations, "iterations");
    while (!trainer.finished() && !stop.requested()) {
      const auto step_start = Clock::now();
      const train::TrainingStep step = trainer.step();
      const double rate = batch / std::max(seconds_since(step_start), 1e-9);
      loss = step.loss;
      if (!step.warning.empty()) say(stderr, "warning: {}\n", step.warning);
      std::optional<train::Validation> validation;
      if (trainer.validation_due()) {
        validation = trainer.validate();
        if (!validation->auc.empty()) {
          say(stdout, "iteration {}: loss {:.5f}{}, active negatives {:.2f}, validation AUC{}{}\n",
              step.iteration, step.loss,
              step.teacher_loss ? fmt::format(", teacher {:.4f}", *step.teacher_loss) : "",
              step.mining.active_negatives, scores(*validation), validation->best ? " (best)" : "");
          std::fflush(stdout);
        }
        if (validation->best && !validation->auc.empty()) {
          nlohmann::ordered_json auc;
          for (const auto& [name, value] : validation->auc) auc[name] = value;
          report["best"] = {
              {"iteration", step.iteration}, {"mean_auc", validation->mean_auc}, {"auc", auc}};
        }
      }
      if (log) log->add(step, validation ? &*validation : nullptr, rate);
      progress.update(step.iteration, fmt::format("loss {:.5f}, {:.0f} images/s", loss, rate));
      if (step.iteration % arguments.checkpoint_every == 0) {
        trainer.save_checkpoint(arguments.checkpoint);
      }
    }
  }
  const double seconds = seconds_since(start);
  report["iterations"] = trainer.iteration();
  report["loss"] = loss;
  report["seconds"] = seconds;
  report["seconds_per_iteration"] =
      seconds / std::max<double>(1, static_cast<double>(trainer.iteration() - first));
  return trainer.finished();
}

// What a baseline that takes minutes does without.
void refuse_options_of_the_metric_head(const Arguments& arguments) {
  for (const auto& [option, value] :
       {std::pair("--resume", arguments.resume), std::pair("--log", arguments.log),
        std::pair("--json", arguments.json), std::pair("--unfreeze", arguments.unfreeze),
        std::pair("--teacher", arguments.data.teachers.empty()
                                   ? std::string()
                                   : arguments.data.teachers.front().string())}) {
    if (value.empty()) continue;
    throw std::invalid_argument(fmt::format("{} goes with --head metric only", option));
  }
}

// The paper's other network, a baseline: no checkpoints, as it takes minutes.
void run_pair_classifier(reid::Model& model, const train::TrainingSet& data,
                         const Arguments& arguments, const StopSignal& stop) {
  std::unique_ptr<Progress> progress;
  std::int64_t cached = 0;
  train::PairTrainingEvents events;
  events.caching = [&](std::int64_t done, std::int64_t total) {
    if (!progress || done < cached) {
      progress = std::make_unique<Progress>("caching", total, "views");
    }
    progress->update(cached = done);
    if (stop.requested()) throw Stopped();
  };
  bool training = false;
  events.step = [&](const train::PairTrainingStep& step) {
    if (!std::exchange(training, true)) {
      progress = std::make_unique<Progress>("training", arguments.trainer.iterations, "iterations");
    }
    progress->update(step.iteration, fmt::format("loss {:.4f}", step.loss));
    for (const auto& [name, auc] : step.auc) {
      say(stdout, "iteration {}: loss {:.4f}, validation AUC  {} {:.4f}{}\n", step.iteration,
          step.loss, name, auc, step.best ? " (best)" : "");
      std::fflush(stdout);
    }
    if (stop.requested()) throw Stopped();
  };
  try {
    auto classifier = train::train_pair_classifier(model, data, arguments.trainer, events,
                                                   arguments.feature_cache);
    progress.reset();
    train::save_pair_classifier(arguments.output, model, classifier, arguments.storage);
    say(stdout, "wrote {}\n", arguments.output);
  } catch (const Stopped&) {
    say(stdout, "stopped, nothing written\n");
  }
}

void train_embedder(Arguments arguments) {
  arguments.data.seed = arguments.trainer.seed;
  arguments.trainer.tie = parse_tie(arguments.tie);
  if (!arguments.unfreeze.empty()) arguments.trainer.first_trained = arguments.unfreeze;
  if (arguments.checkpoint.empty()) arguments.checkpoint = arguments.output + ".checkpoint";
  arguments.trainer.validate();
  if (arguments.head == "pair-classifier") refuse_options_of_the_metric_head(arguments);
  // Nobody trains for hours to learn that the result cannot be written.
  std::vector<NamedPath> inputs{{"--trunk", arguments.trunk}, {"--model", arguments.model}};
  for (const auto& teacher : arguments.data.teachers) inputs.push_back({"--teacher", teacher});
  check_outputs(inputs, {{"--output", arguments.output},
                         {"--checkpoint", arguments.checkpoint},
                         {"--log", arguments.log},
                         {"--json", arguments.json},
                         {"--feature-cache", arguments.feature_cache}});

  const StopSignal stop;
  reid::Model model = starting_model(arguments);
  if (arguments.freeze_trunk) arguments.trainer.first_trained = model.network.head().name(0);
  train::TrainingSet data = train::load_training_set(arguments.data);
  nlohmann::ordered_json report;
  report["images"] = data.images.size();
  report["identities"] = data.identities.size();
  report["unreadable"] = data.unreadable.size();
  if (arguments.head == "pair-classifier") {
    run_pair_classifier(model, data, arguments, stop);
    return;
  }
  train::Trainer trainer(model, std::move(data), arguments.trainer);
  describe(trainer.data(), arguments, trainer);
  if (!arguments.resume.empty()) trainer.load_checkpoint(arguments.resume);

  const auto start = Clock::now();
  try {
    std::unique_ptr<Progress> progress;
    trainer.prepare(
        [&](std::int64_t done, std::int64_t total) {
          if (!progress) progress = std::make_unique<Progress>("caching", total, "views");
          progress->update(done);
          if (stop.requested()) throw Stopped();
        },
        arguments.feature_cache);
  } catch (const Stopped&) {
    return;
  }
  report["cache_seconds"] = seconds_since(start);
  report["cache_bytes"] = trainer.cache_bytes();

  if (!run(trainer, arguments, stop, report)) {
    trainer.save_checkpoint(arguments.checkpoint);
    say(stdout, "stopped after iteration {}: go on with --resume {}\n", trainer.iteration(),
        arguments.checkpoint);
    return;
  }
  trainer.finish();
  reid::save_model(arguments.output, model, arguments.storage);
  say(stdout, "wrote {}\n", arguments.output);
  write_json_file(arguments.json, report);
}

void add_data_options(CLI::App& command, Arguments& a) {
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

void add_model_options(CLI::App& command, Arguments& a) {
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
  command.add_option("--tie", a.tie, "Blocks of the map that share FC1's weights, or none")
      ->capture_default_str();
  command.add_option("--storage", a.storage, "Of the weights: float32, float16 or int8 [float32]")
      ->transform(by_name<reid::Storage>({{"float32", reid::Storage::float32},
                                          {"float16", reid::Storage::float16},
                                          {"int8", reid::Storage::int8}}))
      ->type_name("NAME");
}

void add_teacher_options(CLI::App& command, Arguments& a) {
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

void add_file_options(CLI::App& command, Arguments& a) {
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

void add_train_embedder_command(CLI::App& app) {
  auto* command = app.add_subcommand("train-embedder", "Train the appearance network");
  const auto arguments = std::make_shared<Arguments>();
  add_data_options(*command, *arguments);
  add_model_options(*command, *arguments);
  add_teacher_options(*command, *arguments);
  add_optimisation_options(*command, arguments->trainer);
  add_augmentation_options(*command, arguments->trainer);
  add_file_options(*command, *arguments);
  command->callback([arguments] { train_embedder(*arguments); });
}

}  // namespace sdmt::tools
