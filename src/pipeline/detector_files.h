// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace sdmt::pipeline {

/// The files of a detector network, and what they say without being run.
struct DetectorFiles {
  std::filesystem::path network;  ///< ONNX, or Darknet's .cfg
  std::filesystem::path weights;  ///< Darknet's; empty for ONNX
  int width = 0;                  ///< of the input, pixels; 0 where it is open
  int height = 0;
  bool fixed_size = false;         ///< ONNX that states its input's size
  std::vector<std::string> names;  ///< of the classes; empty when not known

  bool is_darknet() const { return !weights.empty(); }
};

/// Recognises an ONNX file, or a Darknet .cfg with its .weights (either may be named; the other
/// lies beside it under the same name). Class names come from the ONNX file's metadata (`names`, as
/// Ultralytics writes them), or from a .names file beside the .cfg: of the same name, or the only
/// one. Throws std::invalid_argument naming the file that is missing, cut off or of another kind.
DetectorFiles find_detector_files(const std::filesystem::path& file);

}  // namespace sdmt::pipeline
