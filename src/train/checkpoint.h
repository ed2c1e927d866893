// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/process_group.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/train/configuration.h"

namespace sdmt::train {

// The state of a training between two steps. All random numbers come from the seed and the
// iteration (random_stream.h), so that these two stand for generators and sampler position.
struct Checkpoint {
  std::int64_t iteration = 0;
  std::int64_t best_iteration = 0;       // after which the best weights were kept
  std::vector<double> best_scores;       // of the validation sets; 0: nothing validated yet
  std::vector<nn::NamedTensor> tensors;  // weights, statistics, optimiser moments, best weights
};

// Writes a safetensors file that is also a model file (`model`, the present weights).
void write_checkpoint(const std::filesystem::path& path, const reid::Model& model,
                      const Configuration& configuration, const Checkpoint& checkpoint);

// Fills the tensors by name and shape, the iterations (0 <= best_iteration <= iteration <=
// `iterations`), and as many scores (0..1) as there are. Throws std::invalid_argument naming file
// and setting or tensor, also for values that no training has: not finite, or a variance below 0.
void read_checkpoint(const std::filesystem::path& path, const Configuration& configuration,
                     std::int64_t iterations, Checkpoint& checkpoint);

// What process 0 of the group has read, to the others.
void broadcast_checkpoint(nn::ProcessGroup& group, Checkpoint& checkpoint);

}  // namespace sdmt::train
