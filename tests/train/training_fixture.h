// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "reid/temporary_data.h"
#include "sdmt/reid/architectures.h"
#include "sdmt/train/trainer.h"

namespace sdmt::train {

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no exception";
}

/// The paper's network on small pictures, so that a step takes milliseconds.
inline reid::Model small_model(std::uint64_t seed = 0) {
  return reid::untrained_model(reid::vgg16(16, 8), seed);
}

inline TrainerOptions small_options(const std::string& first_trained) {
  TrainerOptions options;
  options.iterations = 8;
  options.identities = 4;
  options.instances = 3;
  options.first_trained = first_trained;
  options.tie = BlockGrid{2, 1};
  options.views = 2;
  options.warmup_iterations = 2;
  options.validate_every = 3;
  return options;
}

/// The bytes of the model (when finished) or nothing.
struct Outcome {
  std::string bytes;
  std::vector<double> losses;
  Validation validation;
};

/// Trains small_model() up to step `until`; a checkpoint is written to `save` then, and `resume`
/// gone on from.
inline Outcome train_set(TrainingSet set, const TrainerOptions& options, std::int64_t until = 1000,
                         const std::filesystem::path& save = {},
                         const std::filesystem::path& resume = {},
                         const std::filesystem::path& cache = {}) {
  const reid::TemporaryData out;
  reid::Model model = small_model();
  Trainer trainer(model, std::move(set), options);
  trainer.prepare({}, cache);
  if (!resume.empty()) trainer.load_checkpoint(resume);
  Outcome outcome;
  while (!trainer.finished() && trainer.iteration() < until) {
    outcome.losses.push_back(trainer.step().loss);
    if (trainer.validation_due()) outcome.validation = trainer.validate();
  }
  if (!save.empty()) trainer.save_checkpoint(save);
  if (!trainer.finished()) return outcome;
  trainer.finish();
  reid::save_model(out.path() / "model", model);
  outcome.bytes = read_file(out.path() / "model");
  return outcome;
}

}  // namespace sdmt::train
