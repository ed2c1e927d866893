// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace sdmt::io {

/// Adds the life time of the object to a sum of seconds.
class Stopwatch {
 public:
  /// `seconds` must outlive it.
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace sdmt::io
