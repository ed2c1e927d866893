// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::train {

// The weights and statistics of the best validation so far.
struct BestWeights {
  std::int64_t iteration = 0;      // after which they were kept
  std::vector<double> scores;      // of the validation sets; 0: nothing validated yet
  std::vector<nn::Tensor> values;  // as the state

  void keep(const std::vector<nn::NamedTensor>& state, std::int64_t after_iteration);
  // Keeps the state when the mean of its scores is the best so far, or when there are none. True
  // when it was kept.
  bool offer(const std::vector<nn::NamedTensor>& state, std::int64_t after_iteration,
             const std::vector<double>& its_scores);
  void restore(const std::vector<nn::NamedTensor>& state) const;
};

double mean_score(const std::vector<double>& scores);  // 0 of none

}  // namespace sdmt::train
