// SPDX-License-Identifier: Apache-2.0
#include "training_configuration.h"

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "hash.h"

namespace sdmt::train {

namespace {

constexpr std::array kOptimizers = {std::pair(OptimizerKind::adam, "adam"),
                                    std::pair(OptimizerKind::sgd, "sgd")};
constexpr std::array kLosses = {std::pair(LossKind::contrastive, "contrastive"),
                                std::pair(LossKind::triplet, "triplet")};
constexpr std::array kTeacherMatches = {std::pair(TeacherMatch::projection, "projection"),
                                        std::pair(TeacherMatch::relations, "relations")};

// A value that nobody has named must not pass for another.
template <typename Names, typename Value>
std::string name_of(Value value, const Names& names) {
  for (const auto& [known, name] : names) {
    if (known == value) return name;
  }
  throw std::logic_error("a training option has a value without a name");
}

std::string tie_text(const std::optional<BlockGrid>& tie) {
  return tie ? std::to_string(tie->rows) + "x" + std::to_string(tie->columns) : "none";
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
  const AugmentationOptions& a = options.augmentation;
  Configuration c;
  c["data"] = std::to_string(data.fingerprint);
  c["unreadable images"] = std::to_string(data.unreadable.size());
  c["seed"] = std::to_string(options.seed);
  c["views"] = std::to_string(options.views);
  c["first_trained"] = options.first_trained;
  c["tie"] = tie_text(options.tie);
  c["frozen weights"] = std::to_string(network.front_fingerprint());
  c["flip"] = to_text(a.flip);
  c["translate"] = to_text(a.translate);
  c["scale"] = to_text(a.scale);
  c["brightness"] = to_text(a.brightness);
  c["contrast"] = to_text(a.contrast);
  c["tint"] = to_text(a.tint);
  c["saturation"] = to_text(a.saturation);
  c["grey"] = to_text(a.grey);
  c["low_resolution"] = to_text(a.low_resolution);
  c["blur"] = to_text(a.blur);
  c["erase"] = to_text(a.erase);
  c["crop"] = to_text(a.crop);
  c["gamma"] = to_text(a.gamma);
  c["offset"] = to_text(a.offset);
  c["grey_patch"] = to_text(a.grey_patch);
  c["noise"] = to_text(a.noise);
  return c;
}

Configuration training_configuration(const TrainerOptions& options, const TrainingSet& data,
                                     Configuration front) {
  Configuration c = std::move(front);
  c["validation data"] = std::to_string(data.validation_fingerprint);
  c["iterations"] = std::to_string(options.iterations);
  c["loss"] = name_of(options.loss.kind, kLosses);
  c["margin"] = to_text(options.loss.margin);
  c["triplet_scale"] = to_text(options.loss.triplet_scale);
  c["identities"] = std::to_string(options.identities);
  c["instances"] = std::to_string(options.instances);
  std::string weights;
  for (const double weight : options.source_weights) weights += to_text(weight) + " ";
  c["source_weights"] = weights;
  c["optimizer"] = name_of(options.optimizer, kOptimizers);
  c["learning_rate"] = to_text(options.learning_rate);
  c["trunk_lr_scale"] = to_text(options.trunk_lr_scale);
  c["momentum"] = to_text(options.momentum);
  c["weight_decay"] = to_text(options.weight_decay);
  c["clip_norm"] = to_text(options.clip_norm);
  c["decay"] = std::to_string(static_cast<int>(options.decay));
  c["decay_start"] = to_text(options.decay_start);
  c["final_factor"] = to_text(options.final_factor);
  c["warmup_iterations"] = std::to_string(options.warmup_iterations);
  c["teacher"] = teacher_text(data.teacher);
  c["teacher_match"] = name_of(options.teacher_match, kTeacherMatches);
  c["teacher_weight"] = to_text(options.teacher_weight);
  c["unlabelled_batch"] = std::to_string(options.unlabelled_batch);
  c["average"] = to_text(options.average);
  c["validate_every"] = std::to_string(options.validate_every);
  return c;
}

}  // namespace sdmt::train
