// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

namespace sdmt::tools {

/// The help as CLI11 writes it, without the "{false}" behind the name of a switch's negation, and
/// as wide as the terminal, or 80 columns.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool is_positional) const override;
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
};

/// Breaks lines that are longer than `width` at blanks. Lines that begin with two blanks, a name
/// and what it means, go on at `column`; the others at the left.
std::string wrap_help(std::string_view text, std::size_t width, std::size_t column);

}  // namespace sdmt::tools
