// SPDX-License-Identifier: Apache-2.0
#include "weight_average.h"

#include <algorithm>
#include <cstddef>

namespace sdmt::train {

void WeightAverage::start(const std::vector<nn::NamedTensor>& state) {
  values_.clear();
  for (const auto& [name, tensor] : state) values_.push_back(*tensor);
}

void WeightAverage::add(const std::vector<nn::NamedTensor>& state, std::int64_t iteration) {
  const auto t = static_cast<double>(iteration);
  const auto step = static_cast<float>(1 - std::min(decay_, (1 + t) / (10 + t)));
  for (std::size_t i = 0; i < values_.size(); ++i) {
    float* average = values_[i].data();
    const float* value = state[i].tensor->data();
    const auto size = static_cast<std::ptrdiff_t>(values_[i].size());
#pragma omp parallel for simd schedule(static)
    for (std::ptrdiff_t k = 0; k < size; ++k) average[k] += step * (value[k] - average[k]);
  }
}

void WeightAverage::swap(const std::vector<nn::NamedTensor>& state) {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    std::swap_ranges(values_[i].values().begin(), values_[i].values().end(),
                     state[i].tensor->data());
  }
}

}  // namespace sdmt::train
