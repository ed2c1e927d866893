// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace sdmt::tools {

/// A file named by an option; an empty path is none, "-" as an output standard output.
struct NamedPath {
  const char* option;
  std::filesystem::path path;
};

/// Finds before the work what would spoil its results after it. Throws std::invalid_argument when
/// two outputs are one file, an output is one of the inputs, or its folder does not exist;
/// std::runtime_error when it cannot be written. Devices such as /dev/null may be given twice. When
/// an output is standard output, what is said to people goes to standard error from here on.
void check_outputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

/// Throws std::invalid_argument when one is "-": files that are read again or written anew.
void refuse_standard_output(const std::vector<NamedPath>& outputs);

}  // namespace sdmt::tools
