// SPDX-License-Identifier: Apache-2.0
#include "training_parts.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "sdmt/nn/adam.h"
#include "sdmt/nn/sgd.h"

namespace sdmt::train {

PkSamplerOptions sampler_options(const TrainerOptions& options) {
  return {options.identities, options.instances, options.source_weights, options.seed};
}

nn::LearningRateSchedule make_schedule(const TrainerOptions& options) {
  return nn::LearningRateSchedule({options.learning_rate, options.iterations,
                                   options.warmup_iterations, options.decay, options.decay_start,
                                   options.final_factor});
}

std::unique_ptr<nn::Optimizer> make_optimizer(const TrainerOptions& options,
                                              std::vector<nn::NamedParameter> parameters) {
  if (options.optimizer == OptimizerKind::sgd) {
    return std::make_unique<nn::Sgd>(
        std::move(parameters),
        nn::SgdOptions{options.learning_rate, options.momentum, options.weight_decay});
  }
  nn::AdamOptions adam;
  adam.learning_rate = options.learning_rate;
  adam.weight_decay = options.weight_decay;
  return std::make_unique<nn::Adam>(std::move(parameters), adam);
}

void require_finite_loss(double loss, std::int64_t iteration) {
  if (std::isfinite(loss)) return;
  throw std::runtime_error("the loss is not finite at iteration " + std::to_string(iteration) +
                           ": lower the learning rate");
}

}  // namespace sdmt::train
