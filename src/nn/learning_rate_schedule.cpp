// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/learning_rate_schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdmt/io/checked_value.h"

namespace sdmt::nn {

void LearningRateScheduleOptions::validate() const {
  io::require(learning_rate >= 0.0 && std::isfinite(learning_rate),
              "LearningRateSchedule: learning_rate", learning_rate, ">= 0");
  io::require(iterations >= 1, "LearningRateSchedule: iterations", iterations, ">= 1");
  io::require(warmup_iterations >= 0, "LearningRateSchedule: warmup_iterations", warmup_iterations,
              ">= 0");
  io::require(decay_start >= 0.0 && decay_start <= 1.0, "LearningRateSchedule: decay_start",
              decay_start, "a value in [0,1]");
  io::require(final_factor > 0.0 && final_factor <= 1.0, "LearningRateSchedule: final_factor",
              final_factor, "a value in (0,1]");
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
