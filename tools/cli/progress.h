// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace sdmt::tools {

/// Shows on stderr how far long work has come, unless quiet: a bar redrawn in place on a terminal,
/// shortened to its width, otherwise a line at every tenth of the work and at least every 30
/// seconds (but never more than one a second).
class Progress {
 public:
  /// `label` says what is done, `unit` what is counted ("frames"). total <= 0: not known, as for a
  /// camera; then counts without a bar.
  Progress(std::string label, std::int64_t total, std::string unit);
  /// Leaves the bar's line.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` of the total are finished; `note` (a loss, a speed) is shown behind the numbers.
  void update(std::int64_t done, std::string_view note = {});

 private:
  using Clock = std::chrono::steady_clock;
  std::string text(std::int64_t done, double seconds, std::string_view note, bool bar) const;

  std::string label_;
  std::string unit_;
  std::int64_t total_;
  bool terminal_;
  Clock::time_point start_;
  Clock::time_point shown_;
  std::int64_t first_ = -1;  // count at the first update: a resumed run starts above 0
  std::int64_t shown_tenth_ = 0;
  std::size_t width_ = 0;  // of the line on the terminal
};

}  // namespace sdmt::tools
