// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace sdmt::nn {

/// The project's only source of randomness: xoshiro256** (Blackman & Vigna, 2018), seeded through
/// SplitMix64. The same seed gives the same numbers on every platform and standard library.
class Random {
 public:
  /// Everything that determines the numbers to come; stored in checkpoints.
  using State = std::array<std::uint64_t, 4>;

  /// Streams of one seed are independent generators (one per image, per purpose, ...).
  explicit Random(std::uint64_t seed = 0, std::uint64_t stream = 0);

  std::uint64_t next();
  /// Uniform in [0, 1), 53 bits.
  double uniform();
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform integer in [0, bound), bound >= 1, without bias.
  std::uint64_t below(std::uint64_t bound);
  /// Standard normal (Box-Muller, two uniforms each, no hidden state).
  double normal();

  /// Fisher-Yates.
  template <typename T>
  void shuffle(std::span<T> values) {
    for (std::size_t i = values.size(); i > 1; --i) {
      std::swap(values[i - 1], values[below(i)]);
    }
  }

  const State& state() const { return state_; }
  void set_state(const State& state) { state_ = state; }

 private:
  State state_;
};

}  // namespace sdmt::nn
