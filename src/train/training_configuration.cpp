// SPDX-License-Identifier: Apache-2.0
#include "training_configuration.h"

#include <cstdint>
#include <string>
#include <utility>

#include "hash.h"
#include "sdmt/train/trainer_option_table.h"

namespace sdmt::train {

namespace {

// What the frozen layers see of the options.
bool concerns_front(const io::Option<TrainerOptions>& option) {
  return option.group == "augmentation" || option.field == "seed" || option.field == "tie";
}

void add_options(const TrainerOptions& options, bool of_front, Configuration& c) {
  for (const auto& option : trainer_option_table()) {
    if (concerns_front(option) == of_front) c[option.field] = option.get(options);
  }
}

std::string teacher_text(const nn::Tensor& vectors) {
  if (vectors.empty()) return "none";
  std::uint64_t state = kEmptyHash;
  hash(state, vectors);
  return std::to_string(state);
}

}  // namespace

Configuration front_configuration(const TrainerOptions& options, const TrainingSet& data,
                                  TrainedNetwork& network) {
  Configuration c;
  add_options(options, true, c);
  c["data"] = std::to_string(data.fingerprint);
  c["unreadable images"] = std::to_string(data.unreadable.size());
  c["first_trained"] = options.first_trained;
  c["frozen weights"] = std::to_string(network.front_fingerprint());
  return c;
}

Configuration training_configuration(const TrainerOptions& options, const TrainingSet& data,
                                     Configuration front) {
  Configuration c = std::move(front);
  add_options(options, false, c);
  c["decay"] = std::to_string(static_cast<int>(options.decay));  // as files have had it
  c["validation data"] = std::to_string(data.validation_fingerprint);
  std::string weights;
  for (const double weight : options.source_weights) weights += to_text(weight) + " ";
  c["source_weights"] = weights;
  c["teacher"] = teacher_text(data.teacher);
  return c;
}

}  // namespace sdmt::train
