// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "sdmt/nn/learning_rate_schedule.h"
#include "sdmt/nn/optimizer.h"
#include "sdmt/train/pk_sampler.h"
#include "sdmt/train/trainer_options.h"

namespace sdmt::train {

// What the options of a training stand for.
PkSamplerOptions sampler_options(const TrainerOptions& options);
nn::LearningRateSchedule make_schedule(const TrainerOptions& options);
std::unique_ptr<nn::Optimizer> make_optimizer(const TrainerOptions& options,
                                              std::vector<nn::NamedParameter> parameters);

// Throws std::runtime_error when the loss of step `iteration`, counted from 1, is not finite.
void require_finite_loss(double loss, std::int64_t iteration);

}  // namespace sdmt::train
