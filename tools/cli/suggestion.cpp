// SPDX-License-Identifier: Apache-2.0
#include "cli/suggestion.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "cli/config_arguments.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::tools {

namespace {

// Letters to insert, remove, change or swap with their neighbour (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::swap(before, above);
    std::swap(above, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, std::span<const std::string> known) {
  constexpr std::size_t kLettersAnError = 3;
  std::size_t least = std::max<std::size_t>(1, word.size() / kLettersAnError) + 1;
  const std::string* nearest = nullptr;
  for (const std::string& name : known) {
    const bool begins = word.size() >= kLettersAnError && name.starts_with(word);
    const std::size_t distance = begins ? 1 : edit_distance(word, name);
    if (distance >= least) continue;
    least = distance;
    nearest = &name;
  }
  return nearest == nullptr ? "" : "; did you mean " + *nearest + "?";
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

void refuse_unknown_words(const CLI::App& app, const std::vector<std::string>& arguments) {
  const auto named = named_commands(app, arguments);
  const CLI::App& command = *named.back();
  const auto first = arguments.begin() + static_cast<std::ptrdiff_t>(named.size()) - 1;
  const auto commands = command_names(command);
  if (!commands.empty() && first != arguments.end() && !first->starts_with('-')) {
    throw std::invalid_argument("unknown command " + io::quoted(*first) +
                                did_you_mean(*first, commands));
  }
  if (!commands.empty() && command.get_parent() != nullptr && first == arguments.end()) {
    std::string names;
    for (const auto& name : commands) names += (names.empty() ? "" : " or ") + name;
    throw std::invalid_argument("expected " + names);
  }
  const auto known = option_names(command);
  for (auto word = first; word != arguments.end() && *word != "--"; ++word) {
    if (!word->starts_with("--")) continue;
    const std::string name = word->substr(0, word->find('='));
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    throw std::invalid_argument("there is no option " + name + did_you_mean(name, known));
  }
}

}  // namespace sdmt::tools
