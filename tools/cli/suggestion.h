// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace sdmt::tools {

/// "; did you mean --output?" for a word that is nearly one of the known ones, or the beginning of
/// one; else nothing.
std::string did_you_mean(std::string_view word, std::span<const std::string> known);

/// Names of the commands of `app`, and of the long options of a command ("--output").
std::vector<std::string> command_names(const CLI::App& app);
std::vector<std::string> option_names(const CLI::App& command);

/// Throws std::invalid_argument for a command or a long option among the words that the command
/// line begins with that is not known. The parser would complain of something missing first.
void refuse_unknown_words(const CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace sdmt::tools
