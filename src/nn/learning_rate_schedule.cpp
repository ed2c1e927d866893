// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/learning_rate_schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace sdmt::nn {

void LearningRateScheduleOptions::validate() const {
  const auto require = [](bool holds, const char* field, double value, const char* expected) {
    if (!holds) {
      throw std::invalid_argument(std::string("LearningRateSchedule: ") + field + " is " +
                                  std::to_string(value) + ", expected " + expected);
    }
  };
  require(learning_rate >= 0.0 && std::isfinite(learning_rate), "learning_rate", learning_rate,
          ">= 0");
  require(iterations >= 1, "iterations", static_cast<double>(iterations), ">= 1");
  require(warmup_iterations >= 0, "warmup_iterations", static_cast<double>(warmup_iterations),
          ">= 0");
  require(decay_start >= 0.0 && decay_start <= 1.0, "decay_start", decay_start, "a value in [0,1]");
  require(final_factor > 0.0 && final_factor <= 1.0, "final_factor", final_factor,
          "a value in (0,1]");
}

LearningRateSchedule::LearningRateSchedule(LearningRateScheduleOptions options)
    : options_(options) {
  options_.validate();
}

double LearningRateSchedule::at(std::int64_t iteration) const {
  const auto i = static_cast<double>(iteration);
  double rate = options_.learning_rate;
  if (iteration < options_.warmup_iterations) {
    rate *= (i + 1.0) / static_cast<double>(options_.warmup_iterations);
  }
  const auto end = static_cast<double>(options_.iterations);
  const double start = options_.decay_start * end;
  if (i <= start) return rate;
  const double t = std::min(1.0, (i - start) / (end - start));
  switch (options_.decay) {
    case LearningRateDecay::constant:
      return rate;
    case LearningRateDecay::exponential:
      return rate * std::pow(options_.final_factor, t);
    case LearningRateDecay::cosine:
      return rate * (options_.final_factor +
                     (1.0 - options_.final_factor) * (1.0 + std::cos(std::numbers::pi * t)) / 2.0);
  }
  return rate;
}

}  // namespace sdmt::nn
