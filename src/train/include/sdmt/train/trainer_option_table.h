// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/io/option_table.h"
#include "sdmt/train/trainer_options.h"

namespace sdmt::train {

/// Every option of a training that is a number or a word, in the order of its help: all but
/// TrainerOptions::source_weights and first_trained.
const io::OptionTable<TrainerOptions>& trainer_option_table();

}  // namespace sdmt::train
