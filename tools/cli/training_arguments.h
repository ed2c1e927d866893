// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "sdmt/reid/model_file.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"

namespace sdmt::tools {

/// What `sdmt train-embedder` is asked for.
struct TrainingArguments {
  train::TrainingSetOptions data;
  train::TrainerOptions trainer;
  std::string output, architecture = "vgg16", trunk, model, unfreeze;
  std::string head = "metric";
  bool freeze_trunk = false;
  reid::Storage storage = reid::Storage::float32;
  std::string checkpoint, resume, log, feature_cache, json;
  std::int64_t checkpoint_every = 1000;
};

/// Adds all options of the command, an option for every entry of train::trainer_option_table()
/// among them. `arguments` must live until the command line is parsed.
void add_training_options(CLI::App& command, TrainingArguments& arguments);

}  // namespace sdmt::tools
