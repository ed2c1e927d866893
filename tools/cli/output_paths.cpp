// SPDX-License-Identifier: Apache-2.0
#include "cli/output_paths.h"

#include <fmt/core.h>

#include <stdexcept>
#include <system_error>

#include "cli/console.h"
#include "sdmt/io/output_file.h"

namespace sdmt::tools {

namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  if (path.empty() || path == "-") return false;
  std::error_code ignored;
  return !fs::exists(path, ignored) || fs::is_regular_file(path, ignored);
}

bool same_file(const fs::path& a, const fs::path& b) {
  if (!is_file(a) || !is_file(b)) return false;
  std::error_code ignored;
  return fs::equivalent(a, b, ignored) ||
         fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored);
}

void refuse(const NamedPath& output, const NamedPath& other, const char* what) {
  throw std::invalid_argument(fmt::format("{} {}: {} {}, expected another file", output.option,
                                          output.path.string(), what, other.option));
}

}  // namespace

void check_outputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    for (const NamedPath& input : inputs) {
      if (same_file(outputs[i].path, input.path)) refuse(outputs[i], input, "is read as");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const bool both_printed = outputs[i].path == "-" && outputs[j].path == "-";
      if (both_printed || same_file(outputs[i].path, outputs[j].path)) {
        refuse(outputs[i], outputs[j], "is written by");
      }
    }
  }
  for (const NamedPath& output : outputs) {
    if (output.path == "-") give_standard_output_to_result();
    // A pipe or device is not opened twice: its reader would see an end.
    std::error_code ignored;
    if (is_file(output.path) || fs::is_directory(output.path, ignored)) {
      const io::OutputFile writable(output.path);
    }
  }
}

void refuse_standard_output(const std::vector<NamedPath>& outputs) {
  for (const NamedPath& output : outputs) {
    if (output.path == "-") {
      throw std::invalid_argument(
          fmt::format("{} is -, expected a file (one of that name is ./-)", output.option));
    }
  }
}

}  // namespace sdmt::tools
