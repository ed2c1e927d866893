// SPDX-License-Identifier: Apache-2.0
// sdmt.train: in a module of its own, because it needs OpenCV.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>

#include "option_texts.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/reid/architectures.h"
#include "sdmt/train/trainer.h"
#include "sdmt/train/trainer_option_table.h"
#include "signals.h"

namespace {

using namespace sdmt;
namespace py = pybind11;
using namespace py::literals;

reid::Storage parse_storage(const std::string& name) {
  if (name == "float32") return reid::Storage::float32;
  if (name == "float16") return reid::Storage::float16;
  if (name == "int8") return reid::Storage::int8;
  io::refuse_value("storage", io::quoted(name), "float32, float16 or int8");
}

// As `sdmt train-embedder` begins.
reid::Model starting_model(const std::string& model_file, const std::string& architecture,
                           const std::string& trunk, std::uint64_t seed) {
  if (!model_file.empty()) return reid::load_model(model_file);
  reid::Model model = reid::untrained_model(reid::find_architecture(architecture), seed);
  if (!trunk.empty()) {
    reid::load_trunk(trunk, model.network);
    model.metadata.provenance = "trunk from " + std::filesystem::path(trunk).filename().string();
  }
  return model;
}

py::object number_or_none(const std::optional<double>& number) {
  return number ? py::object(py::float_(*number)) : py::none();
}

py::dict step_dict(const train::TrainingStep& step) {
  return py::dict("iteration"_a = step.iteration, "loss"_a = step.loss,
                  "teacher_loss"_a = number_or_none(step.teacher_loss),
                  "learning_rate"_a = step.learning_rate, "gradient_norm"_a = step.gradient_norm,
                  "active_negatives"_a = step.mining.active_negatives, "warning"_a = step.warning,
                  "validation_auc"_a = py::none());
}

py::dict run_training(const train::TrainingSetOptions& sets, const std::string& output,
                      const std::string& model_file, const std::string& architecture,
                      const std::string& trunk, const std::string& unfreeze, bool freeze_trunk,
                      const std::string& storage_name, const std::string& checkpoint,
                      std::int64_t checkpoint_every, const std::string& resume,
                      const python::OptionTexts& texts, const py::object& progress) {
  const auto storage = parse_storage(storage_name);
  auto options = python::to_options(texts, train::trainer_option_table(), "training");
  train::TrainingSetOptions data = sets;
  data.seed = options.seed;
  options.first_trained = unfreeze;
  options.validate();
  io::require(checkpoint_every >= 1, "checkpoint_every", checkpoint_every, ">= 1");

  const py::gil_scoped_release free;
  reid::Model model = starting_model(model_file, architecture, trunk, options.seed);
  if (freeze_trunk) options.first_trained = model.network.head().name(0);
  train::Trainer trainer(model, train::load_training_set(data), options);
  if (!resume.empty()) trainer.load_checkpoint(resume);
  trainer.prepare([](std::int64_t, std::int64_t) { python::look_for_signals(); });

  double loss = 0;
  std::vector<std::pair<std::string, double>> best;
  std::int64_t best_iteration = 0;
  try {
    while (!trainer.finished()) {
      const train::TrainingStep step = trainer.step();
      loss = step.loss;
      train::Validation validation;
      if (trainer.validation_due()) validation = trainer.validate();
      if (validation.best && !validation.auc.empty()) {
        best = validation.auc, best_iteration = step.iteration;
      }
      if (!checkpoint.empty() && step.iteration % checkpoint_every == 0) {
        trainer.save_checkpoint(checkpoint);
      }
      python::look_for_signals();
      const py::gil_scoped_acquire held;
      if (progress.is_none()) continue;
      py::dict report = step_dict(step);
      if (!validation.auc.empty()) report["validation_auc"] = py::dict(py::cast(validation.auc));
      progress(report);
    }
  } catch (const py::error_already_set&) {  // Ctrl-C, or progress threw
    if (!checkpoint.empty()) trainer.save_checkpoint(checkpoint);
    throw;
  }
  trainer.finish();
  reid::save_model(output, model, storage);
  const py::gil_scoped_acquire held;
  return py::dict("iterations"_a = trainer.iteration(), "loss"_a = loss,
                  "images"_a = trainer.data().images.size(),
                  "people"_a = trainer.data().identities.size(),
                  "unreadable"_a = trainer.data().unreadable.size(),
                  "best_iteration"_a = best_iteration, "best_auc"_a = py::dict(py::cast(best)));
}

}  // namespace

PYBIND11_MODULE(_train, module) {
  module.def(
      "train",
      [](const std::vector<std::string>& folders, const std::vector<std::string>& unlabelled,
         const std::vector<std::string>& teachers, const std::vector<std::string>& validate,
         int holdout, const std::string& output, const std::string& model,
         const std::string& architecture, const std::string& trunk, const std::string& unfreeze,
         bool freeze_trunk, const std::string& storage, const std::string& checkpoint,
         std::int64_t checkpoint_every, const std::string& resume,
         const python::OptionTexts& options, const py::object& progress) {
        train::TrainingSetOptions sets;
        sets.folders.assign(folders.begin(), folders.end());
        sets.unlabelled_folders.assign(unlabelled.begin(), unlabelled.end());
        sets.teachers.assign(teachers.begin(), teachers.end());
        sets.validation_folders.assign(validate.begin(), validate.end());
        sets.holdout_identities = holdout;
        return run_training(sets, output, model, architecture, trunk, unfreeze, freeze_trunk,
                            storage, checkpoint, checkpoint_every, resume, options, progress);
      });
  module.def("options", [] {
    python::OptionTexts options;
    for (const auto& entry : train::trainer_option_table()) options[entry.name] = entry.get({});
    return options;
  });
}
