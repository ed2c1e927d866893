// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::train {

// The exponential moving average of a training's weights and running statistics (Polyak and
// Juditsky, 1992, with forgetting): it follows the training with less noise.
class WeightAverage {
 public:
  // `decay` in [0, 1): what is kept at each step; smaller in the first steps, as (1 + t) / (10 +
  // t), so that the start is soon forgotten.
  explicit WeightAverage(double decay) : decay_(decay) {}

  void start(const std::vector<nn::NamedTensor>& state);
  // After step `iteration`, counted from 1.
  void add(const std::vector<nn::NamedTensor>& state, std::int64_t iteration);
  // The network takes the average and this object the network's values, or back again.
  void swap(const std::vector<nn::NamedTensor>& state);

  std::vector<nn::Tensor>& values() { return values_; }  // as the state

 private:
  double decay_;
  std::vector<nn::Tensor> values_;
};

}  // namespace sdmt::train
