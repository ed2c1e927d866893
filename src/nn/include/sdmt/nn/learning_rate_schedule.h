// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace sdmt::nn {

enum class LearningRateDecay { constant, cosine, exponential };

/// A learning rate that rises linearly over the first iterations, stays, and then falls.
struct LearningRateScheduleOptions {
  double learning_rate = 3e-4;                               ///< the plateau, >= 0
  std::int64_t iterations = 1;                               ///< of the whole training, >= 1
  std::int64_t warmup_iterations = 0;                        ///< >= 0
  LearningRateDecay decay = LearningRateDecay::exponential;  ///< shape of the fall
  double decay_start = 0.6;                                  ///< fraction of iterations, in [0,1]
  double final_factor = 1e-3;                                ///< last / plateau, in (0,1]

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Learning rate of iteration i, 0 <= i < iterations:
/// plateau * min(1, (i + 1) / warmup_iterations) * f((i - s) / (iterations - s)) with s =
/// decay_start * iterations, f(t) = 1 for t <= 0, final_factor^t (exponential, as Hermans et al.,
/// "In Defense of the Triplet Loss", 2017), or final_factor + (1 - final_factor) (1 + cos(pi t)) /
/// 2 (cosine).
class LearningRateSchedule {
 public:
  /// Throws as LearningRateScheduleOptions::validate().
  explicit LearningRateSchedule(LearningRateScheduleOptions options);

  double at(std::int64_t iteration) const;

 private:
  LearningRateScheduleOptions options_;
};

}  // namespace sdmt::nn
