// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>

#include "sdmt/pipeline/line_output.h"

namespace sdmt::pipeline {

/// Removes what an output without an end has put aside, once it is old enough: regular files beside
/// it whose names rotated_name() can have made of its name, and that nobody has written to for
/// `flowing.keep` seconds. Nothing else is touched.
class Retention {
 public:
  Retention(std::filesystem::path path, const Flowing& flowing)
      : path_(std::move(path)), keep_(flowing.keep), tell_(flowing.tell) {}

  /// To be called often; looks at the folder at most once a minute. A file that cannot be removed
  /// is told once an hour.
  void look();

 private:
  using Clock = std::chrono::steady_clock;

  std::filesystem::path path_;
  double keep_;
  std::function<void(const std::string&)> tell_;
  Clock::time_point looked_, told_;
};

}  // namespace sdmt::pipeline
