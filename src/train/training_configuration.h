// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/train/configuration.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"
#include "trained_network.h"

namespace sdmt::train {

// What determines the results of the frozen layers for every view: a file of cached features
// belongs to one of these.
Configuration front_configuration(const TrainerOptions& options, const TrainingSet& data,
                                  TrainedNetwork& network);

// What determines the steps of a training, `front` included: a checkpoint belongs to one of these.
Configuration training_configuration(const TrainerOptions& options, const TrainingSet& data,
                                     Configuration front);

}  // namespace sdmt::train
