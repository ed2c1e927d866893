// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <mutex>

namespace sdmt::io {

/// Carries an exception out of an OpenMP loop, which none may leave:
///
///     FirstError error;
///     #pragma omp parallel for
///     for (int i = 0; i < n; ++i) error.guard([&] { work(i); });
///     error.rethrow();
class FirstError {
 public:
  /// Runs `work`; what it throws is kept, unless another has been already.
  template <typename Work>
  void guard(Work&& work) noexcept {
    try {
      work();
    } catch (...) {
      const std::scoped_lock lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }
  /// Whether anything was kept: what is left to do is no longer needed.
  bool caught() const {
    const std::scoped_lock lock(mutex_);
    return error_ != nullptr;
  }
  /// Throws what was kept, if anything was. To be called when all threads are done.
  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  mutable std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace sdmt::io
