// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace sdmt::tools {

/// For CLI::Option::transform: the value that a word stands for. CLI11's own transformer takes and
/// lists the numbers behind the words as well.
template <typename Value>
CLI::Validator by_name(const std::map<std::string, Value>& values) {
  const auto replace = [values](std::string& text) {
    const auto found = values.find(text);
    if (found != values.end()) {
      text = std::to_string(static_cast<int>(found->second));
      return std::string();
    }
    std::string known;
    for (const auto& [name, value] : values) known += (known.empty() ? "" : ", ") + name;
    return fmt::format("'{}' is none of {}", text, known);
  };
  return {replace, ""};
}

}  // namespace sdmt::tools
