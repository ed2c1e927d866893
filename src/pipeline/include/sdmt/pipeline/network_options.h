// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "sdmt/mot/class_filter.h"

namespace sdmt::pipeline {

struct NetworkOptions {
  /// ONNX, or Darknet's .cfg or .weights, the other beside it under the same name.
  std::filesystem::path file;
  /// The network's input has as many pixels as a square of this side, a multiple of 32 in 32..4096;
  /// 0: the network's own. People smaller than some 20 pixels there are not found.
  int size = 0;
  /// A network of one class is taken for one of people, whatever the class is called.
  mot::ClassFilter classes{};
  /// Boxes below are dropped; 0..1. The tracker continues tracks with weak boxes.
  double min_score = 0.1;

  /// Throws std::invalid_argument for a value out of range.
  void validate() const;
};

}  // namespace sdmt::pipeline
