// SPDX-License-Identifier: Apache-2.0
#include "cli/help_formatter.h"

#include <algorithm>
#include <utility>

#include "cli/console.h"

namespace sdmt::tools {

std::string HelpFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  std::string name = CLI::Formatter::make_option_name(option, is_positional);
  constexpr std::string_view kNegation = "{false}";
  if (const auto at = name.find(kNegation); at != std::string::npos) {
    name.erase(at, kNegation.size());
  }
  return name;
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name,
                                     CLI::AppFormatMode mode) const {
  constexpr int kNarrowest = 50, kUsual = 80;
  const int width = std::max(kNarrowest, console_width(stdout).value_or(kUsual));
  return wrap_help(CLI::Formatter::make_help(app, std::move(name), mode),
                   static_cast<std::size_t>(width), get_column_width());
}

std::string wrap_help(std::string_view text, std::size_t width, std::size_t column) {
  std::string wrapped;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::size_t indent = line.starts_with("  ") ? column : 0;
    std::size_t used = 0;  // columns taken by the indent of the present line
    while (used + line.size() > width) {
      // The last blank that fits and does not belong to the indent.
      const std::size_t from = used == 0 && indent > 0 ? indent : 0;
      std::size_t at = line.rfind(' ', width - used);
      if (at == std::string_view::npos || at <= from) at = line.find(' ', from + 1);
      if (at == std::string_view::npos) break;
      wrapped += line.substr(0, at);
      wrapped += "\n" + std::string(indent, ' ');
      line.remove_prefix(at + 1);
      used = indent;
    }
    wrapped += line;
    wrapped += '\n';
  }
  return wrapped;
}

}  // namespace sdmt::tools
