// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// The frames of a run that could not be read, whoever wanted to: the tracker, the detector, or the
/// video in which they are drawn. Each is said and counted once.
class UnreadableFrames {
 public:
  using Warning = std::function<void(const std::string&)>;  // takes one line of text

  explicit UnreadableFrames(Warning warning = {}) : warning_(std::move(warning)) {}

  /// Does nothing for a frame without a problem. `consequence`: what is done instead.
  void add(const Frame& frame, const char* consequence) {
    if (frame.problem.empty() || !numbers_.insert(frame.number).second) return;
    if (first_problem_.empty()) first_problem_ = frame.problem;
    if (warning_) warning_(frame.problem + "; " + consequence);
  }

  int count() const { return static_cast<int>(numbers_.size()); }
  const std::string& first_problem() const { return first_problem_; }

 private:
  Warning warning_;
  std::set<int> numbers_;
  std::string first_problem_;
};

}  // namespace sdmt::pipeline
