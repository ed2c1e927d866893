// SPDX-License-Identifier: Apache-2.0
#include "manual/command_line.h"

#include <algorithm>
#include <cctype>

namespace sdmt::tools {

namespace {

// "a, b or c" and "A|B" as words; nothing when it is anything else, such as a range.
std::vector<std::string> split_words(std::string text) {
  for (const std::string separator : {", ", " or ", "|"}) {
    for (auto at = text.find(separator); at != std::string::npos; at = text.find(separator)) {
      text.replace(at, separator.size(), 1, '\n');
    }
  }
  std::vector<std::string> words{""};
  for (const char c : text) {
    if (c == '\n') {
      words.emplace_back();
    } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_') {
      words.back() += c;
    } else {
      return {};
    }
  }
  const bool all_begin_with_letters =
      std::all_of(words.begin(), words.end(), [](const std::string& word) {
        return !word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) != 0;
      });
  if (words.size() < 2 || !all_begin_with_letters) return {};
  return words;
}

bool is_upper(const std::string& word) {
  return std::none_of(word.begin(), word.end(),
                      [](unsigned char c) { return std::islower(c) != 0; });
}

// What is left of `text` behind the last `open`, up to `close` at its end.
std::string last_part(const std::string& text, char open, char close) {
  if (text.empty() || text.back() != close) return {};
  const auto at = text.rfind(open);
  return at == std::string::npos ? "" : text.substr(at + 1, text.size() - at - 2);
}

OptionLine describe(const CLI::Option& option) {
  OptionLine line;
  for (const std::string& name : option.get_snames()) line.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) line.names.push_back("--" + name);
  line.help = option.get_description();
  line.group = option.get_group();
  line.required = option.get_required();
  if (option.get_items_expected_max() > 0) {
    line.value = option.get_type_name();
    // Validators stand behind a type, as "TEXT:{a,b}".
    const auto end = line.value.find_first_of(": ");
    const std::string validator = last_part(line.value, '{', '}');
    if (end != std::string::npos) line.value.resize(end);
    if (line.value.empty()) line.value = "VALUE";
    const std::string& type = line.value;
    line.takes_path = type.find("FILE") != std::string::npos ||
                      type.find("DIR") != std::string::npos || type == "INPUT" || type == "TEXT";
    for (const std::string& told : {validator, last_part(line.help, '(', ')'), type}) {
      if (line.words.empty()) line.words = split_words(told);
    }
    if (line.takes_path && std::all_of(line.words.begin(), line.words.end(), is_upper)) {
      line.words.clear();  // FILE|DIR
    }
    if (!option.get_default_str().empty()) line.help += " [" + option.get_default_str() + "]";
  }
  if (line.names.empty()) line.value = option.get_type_name();
  return line;
}

void collect(const CLI::App& app, const std::string& name, std::vector<CommandLine>& commands) {
  const auto inner = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* command : inner) {
    collect(*command, name.empty() ? command->get_name() : name + " " + command->get_name(),
            commands);
  }
  if (!inner.empty()) return;
  CommandLine line{name, app.get_description(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? line.arguments : line.options).push_back(describe(*option));
  }
  commands.push_back(std::move(line));
}

}  // namespace

std::vector<CommandLine> command_lines(const CLI::App& app) {
  std::vector<CommandLine> commands;
  collect(app, "", commands);
  return commands;
}

}  // namespace sdmt::tools
