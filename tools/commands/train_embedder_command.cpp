// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
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
#include "cli/output_paths.h"
#include "cli/processes.h"
#include "cli/progress.h"
#include "cli/stop_signal.h"
#include "cli/training_arguments.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/pair_classifier.h"
#include "sdmt/train/trainer.h"
#include "sdmt/train/training_log.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// Thrown out of the caching of features, which cannot be stopped otherwise.
double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

reid::Model starting_model(const TrainingArguments& arguments) {
  if (!arguments.model.empty()) return reid::load_model(arguments.model);
  reid::Model model = reid::untrained_model(reid::find_architecture(arguments.architecture),
                                            arguments.trainer.seed);
  if (!arguments.trunk.empty()) {
    const auto ignored = reid::load_trunk(arguments.trunk, model.network);
    model.metadata.provenance = "trunk from " + fs::path(arguments.trunk).filename().string();
    if (!ignored.empty()) {
      note("{}: {} tensors besides the trunk are ignored, the first is {}\n", arguments.trunk,
           ignored.size(), ignored.front());
    }
  }
  return model;
}

void describe(const train::TrainingSet& set, const TrainingArguments& arguments,
              const train::Trainer& trainer) {
  note("training on {} images of {} people\n", set.images.size(), set.identities.size());
  if (!set.unlabelled.empty()) {
    note("{} of the images are nobody's in particular\n", set.unlabelled.size());
  }
  if (!set.teacher.empty()) {
    note("taught by vectors of {} values", set.teacher.shape().c);
    if (trainer.teacher_kept() < 1) {
      note(", of which the principal axes keep {:.1f} %", 100 * trainer.teacher_kept());
    }
    note("\n");
  }
  for (const auto& validation : set.validation) {
    note("validating on {}: {} images of {} people\n", validation.name, validation.images.size(),
         validation.labels.back() + 1);
  }
  for (const auto& path : set.unreadable) say(stdout, "left out, unreadable: {}\n", path.string());
  if (const auto files = set.left_out.text(); !files.empty()) say(stdout, "left out: {}\n", files);
  if (trainer.cache_bytes() > 0) {
    note("features of {} views of each image take {} MiB {}\n", arguments.trainer.views,
         trainer.cache_bytes() >> 20,
         arguments.feature_cache.empty() ? "of memory" : "in " + arguments.feature_cache);
  }
}

std::string scores(const train::Validation& validation) {
  std::string text;
  for (const auto& [name, auc] : validation.auc) text += fmt::format("  {} {:.4f}", name, auc);
  return text;
}

// A checkpoint that cannot be written, because another program holds it or the disk is full, does
// not end a training of hours: it is tried again.
class Checkpoints {
 public:
  Checkpoints(std::string path, std::int64_t every) : path_(std::move(path)), every_(every) {}

  void after(std::int64_t iteration, train::Trainer& trainer) {
    constexpr std::int64_t kRetry = 10;  // iterations
    if (iteration % every_ != 0 && !(owed_ && iteration % kRetry == 0)) return;
    try {
      trainer.save_checkpoint(path_);
      owed_ = false;
    } catch (const std::runtime_error& error) {
      if (!owed_) say(stderr, "warning: {}; the checkpoint is tried again\n", error.what());
      owed_ = true;
    }
  }

 private:
  std::string path_;
  std::int64_t every_;
  bool owed_ = false;
};

// The training itself. Returns false when a signal ended it.
bool run(train::Trainer& trainer, const TrainingArguments& arguments, const StopSignal& stop,
         const Processes& processes, nlohmann::ordered_json& report) {
  std::optional<train::TrainingLog> log;
  if (!arguments.log.empty() && processes.is_first()) {
    log.emplace(arguments.log, trainer.iteration(), !trainer.data().teacher.empty());
  }
  const double batch = arguments.trainer.identities * arguments.trainer.instances +
                       (trainer.data().unlabelled.empty() ? 0 : arguments.trainer.unlabelled_batch);
  Checkpoints checkpoints(arguments.checkpoint, arguments.checkpoint_every);
  const auto start = Clock::now();
  const auto first = trainer.iteration();
  const std::int64_t sent_before = processes.bytes_sent();
  double loss = 0;
  {
    Progress progress("training", arguments.trainer.iterations, "iterations");
    while (!trainer.finished() && !processes.any(stop.requested())) {
      const auto step_start = Clock::now();
      const train::TrainingStep step = trainer.step();
      const double rate = batch / std::max(seconds_since(step_start), 1e-9);
      loss = step.loss;
      if (!step.warning.empty()) say(stderr, "warning: {}\n", step.warning);
      std::optional<train::Validation> validation;
      if (trainer.validation_due()) {
        validation = trainer.validate();
        if (!validation->auc.empty()) {
          note("iteration {}: loss {:.5f}{}, active negatives {:.2f}, validation AUC{}{}\n",
               step.iteration, step.loss,
               step.teacher_loss ? fmt::format(", teacher {:.4f}", *step.teacher_loss) : "",
               step.mining.active_negatives, scores(*validation),
               validation->best ? " (best)" : "");
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
      if (processes.is_first()) checkpoints.after(step.iteration, trainer);
    }
  }
  const double seconds = seconds_since(start);
  if (processes.group().size() > 1) {
    report["processes"] = processes.group().size();
    report["bytes_sent_per_iteration"] =
        static_cast<double>(processes.bytes_sent() - sent_before) /
        std::max<double>(1, static_cast<double>(trainer.iteration() - first));
  }
  report["iterations"] = trainer.iteration();
  report["loss"] = loss;
  report["seconds"] = seconds;
  report["seconds_per_iteration"] =
      seconds / std::max<double>(1, static_cast<double>(trainer.iteration() - first));
  return trainer.finished();
}

// What a baseline that takes minutes does without.
void refuse_options_of_the_metric_head(const TrainingArguments& arguments) {
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
void run_pair_classifier(reid::Model& model, train::TrainingSet data,
                         const TrainingArguments& arguments, const StopSignal& stop,
                         const Processes& processes) {
  std::unique_ptr<Progress> progress;
  train::PairTrainingEvents events;
  events.caching = [&](std::int64_t done, std::int64_t total) {
    if (!progress) progress = std::make_unique<Progress>("caching", total, "views");
    progress->update(done);
    if (processes.any(stop.requested())) throw Stopped();
  };
  bool training = false;
  events.step = [&](const train::PairTrainingStep& step) {
    if (!std::exchange(training, true)) {
      progress = std::make_unique<Progress>("training", arguments.trainer.iterations, "iterations");
    }
    progress->update(step.iteration, fmt::format("loss {:.4f}", step.loss));
    for (const auto& [name, auc] : step.auc) {
      note("iteration {}: loss {:.4f}, validation AUC  {} {:.4f}{}\n", step.iteration, step.loss,
           name, auc, step.best ? " (best)" : "");
      std::fflush(stdout);
    }
    if (processes.any(stop.requested())) throw Stopped();
  };
  try {
    auto classifier =
        train::train_pair_classifier(model, std::move(data), arguments.trainer, events,
                                     arguments.feature_cache, processes.group());
    progress.reset();
    if (!processes.is_first()) return;
    train::save_pair_classifier(arguments.output, model, classifier, arguments.storage);
    note("wrote {}\n", arguments.output);
  } catch (const Stopped&) {
    say(stdout, "stopped, nothing written\n");
  }
}

void check_files(const TrainingArguments& arguments) {
  std::vector<NamedPath> inputs{{"--trunk", arguments.trunk}, {"--model", arguments.model}};
  for (const auto& teacher : arguments.data.teachers) inputs.push_back({"--teacher", teacher});
  refuse_standard_output({{"--output", arguments.output},
                          {"--checkpoint", arguments.checkpoint},
                          {"--log", arguments.log},
                          {"--feature-cache", arguments.feature_cache}});
  check_outputs(inputs, {{"--output", arguments.output},
                         {"--checkpoint", arguments.checkpoint},
                         {"--log", arguments.log},
                         {"--json", arguments.json},
                         {"--feature-cache", arguments.feature_cache}});
}

void train_embedder(TrainingArguments arguments, const Processes& processes) {
  arguments.data.seed = arguments.trainer.seed;
  if (!arguments.unfreeze.empty()) arguments.trainer.first_trained = arguments.unfreeze;
  if (arguments.checkpoint.empty()) arguments.checkpoint = arguments.output + ".checkpoint";
  arguments.trainer.validate();
  if (arguments.head == "pair-classifier") refuse_options_of_the_metric_head(arguments);
  // Nobody trains for hours to learn that the result cannot be written.
  if (processes.is_first()) check_files(arguments);

  const StopSignal stop;
  reid::Model model = starting_model(arguments);
  if (arguments.freeze_trunk) arguments.trainer.first_trained = model.network.head().name(0);
  train::TrainingSet data = train::load_training_set(arguments.data, processes.group());
  nlohmann::ordered_json report;
  report["images"] = data.images.size();
  report["identities"] = data.identities.size();
  report["unreadable"] = data.unreadable.size();
  if (arguments.head == "pair-classifier") {
    run_pair_classifier(model, std::move(data), arguments, stop, processes);
    return;
  }
  train::Trainer trainer(model, std::move(data), arguments.trainer, processes.group());
  describe(trainer.data(), arguments, trainer);
  if (!arguments.resume.empty()) trainer.load_checkpoint(arguments.resume);

  const auto start = Clock::now();
  try {
    std::unique_ptr<Progress> progress;
    trainer.prepare(
        [&](std::int64_t done, std::int64_t total) {
          if (!progress) progress = std::make_unique<Progress>("caching", total, "views");
          progress->update(done);
          if (processes.any(stop.requested())) throw Stopped();
        },
        arguments.feature_cache);
  } catch (const Stopped&) {
    return;
  }
  report["cache_seconds"] = seconds_since(start);
  report["cache_bytes"] = trainer.cache_bytes();

  if (!run(trainer, arguments, stop, processes, report)) {
    trainer.save_checkpoint(arguments.checkpoint);  // the first's
    say(stdout, "stopped after iteration {}: go on with --resume {}\n", trainer.iteration(),
        arguments.checkpoint);
    return;
  }
  trainer.finish();
  if (!processes.is_first()) return;
  reid::save_model(arguments.output, model, arguments.storage);
  note("wrote {}\n", arguments.output);
  write_json_file(arguments.json, report);
}

}  // namespace

void add_train_embedder_command(CLI::App& app) {
  auto* command = app.add_subcommand("train-embedder", "Train the appearance network");
  const auto arguments = std::make_shared<TrainingArguments>();
  add_training_options(*command, *arguments);
  command->callback([arguments] {
    Processes processes;
    try {
      train_embedder(*arguments, processes);
      processes.leave();
    } catch (const std::exception& error) {
      processes.fail(error);
      throw;
    }
  });
}

}  // namespace sdmt::tools
