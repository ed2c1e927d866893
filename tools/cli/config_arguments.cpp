// SPDX-License-Identifier: Apache-2.0
#include "cli/config_arguments.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "cli/console.h"
#include "cli/shipped_files.h"
#include "cli/suggestion.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/json_text.h"

namespace sdmt::tools {

namespace {

using nlohmann::json;

[[noreturn]] void reject(const std::string& file, const std::string& key, const std::string& why) {
  throw std::invalid_argument(fmt::format("{}: key \"{}\": {}", file, key, why));
}

// The values of every --config; "--config" itself stays for the parser to check.
std::vector<std::string> config_files(const std::vector<std::string>& arguments) {
  constexpr std::string_view kJoined = "--config=";
  std::vector<std::string> files;
  for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i) {
    if (arguments[i] == "--config" && i + 1 < arguments.size()) {
      files.push_back(arguments[++i]);
    } else if (arguments[i].starts_with(kJoined)) {
      files.push_back(arguments[i].substr(kJoined.size()));
    }
  }
  return files;
}

// Null where there is none. CLI11's own search ends the program when memory runs out in it.
const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    const auto& names = option->get_lnames();
    if (std::find(names.begin(), names.end(), name) != names.end()) return option;
  }
  return nullptr;
}

json read_object(const std::string& file) {
  const std::string text = io::read_text(file);
  io::check_json(text, file + ":");
  json object = json::parse(text);
  if (!object.is_object()) {
    throw std::invalid_argument(file + ": expected a JSON object of options");
  }
  return object;
}

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

std::string value_text(const CLI::Option& option, const json& value, const std::string& file,
                       const std::string& key) {
  const std::string type = option.get_type_name();
  const bool wants_integer = type.starts_with("INT") || type.starts_with("UINT");
  const bool wants_number = wants_integer || type.starts_with("FLOAT");
  if (value.is_string()) {
    if (wants_number) reject(file, key, fmt::format("expected a number, got {}", value.dump()));
    return value.get<std::string>();
  }
  if (!value.is_number()) {
    reject(file, key,
           fmt::format("expected {}, got {}", wants_number ? "a number" : "a value", value.dump()));
  }
  if (wants_integer && !value.is_number_integer()) {
    reject(file, key, fmt::format("expected an integer, got {}", value.dump()));
  }
  return value.dump();
}

std::vector<std::string> option_words(const CLI::Option& option, const json& value,
                                      const std::string& file, const std::string& key) {
  if (is_flag(option)) {
    if (!value.is_boolean()) reject(file, key, "expected true or false, got " + value.dump());
    return {fmt::format("--{}={}", key, value.get<bool>())};
  }
  std::vector<std::string> words;
  if (value.is_array()) {
    if (option.get_items_expected_max() <= 1) reject(file, key, "expected one value, got a list");
    for (const json& item : value) {
      words.push_back(fmt::format("--{}={}", key, value_text(option, item, file, key)));
    }
  } else {
    words.push_back(fmt::format("--{}={}", key, value_text(option, value, file, key)));
  }
  return words;
}

bool typed(const CLI::Option& option, const std::vector<std::string>& arguments) {
  return std::any_of(arguments.begin(), arguments.end(), [&](const std::string& argument) {
    const auto& names = option.get_lnames();
    return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      return argument == "--" + name || argument.starts_with("--" + name + "=");
    });
  });
}

// Or one was typed that cannot stand beside it: --model where the file names an architecture.
bool overruled(const CLI::Option& option, const std::vector<std::string>& arguments) {
  const auto excluded = option.get_excludes();
  return typed(option, arguments) ||
         std::any_of(excluded.begin(), excluded.end(),
                     [&](const CLI::Option* other) { return typed(*other, arguments); });
}

}  // namespace

std::vector<const CLI::App*> named_commands(const CLI::App& app,
                                            const std::vector<std::string>& arguments) {
  std::vector<const CLI::App*> commands{&app};
  for (const std::string& argument : arguments) {
    const auto inner = commands.back()->get_subcommands(
        [&](const CLI::App* candidate) { return candidate->check_name(argument); });
    if (inner.empty()) break;
    commands.push_back(inner.front());
  }
  return commands;
}

std::string command_name(const CLI::App& app, const std::vector<std::string>& arguments) {
  std::string name;
  for (const CLI::App* command : named_commands(app, arguments)) {
    name += (name.empty() ? "" : " ") + command->get_name();
  }
  return name;
}

ExpandedArguments expand_config(const CLI::App& app, std::vector<std::string> arguments) {
  ExpandedArguments expanded;
  const auto commands = named_commands(app, arguments);
  const CLI::App* command = commands.back();

  std::map<std::string, std::vector<std::string>> words;
  for (const std::string& name : config_files(arguments)) {
    const std::string file = find_config_file(name).string();
    const json object = read_object(file);
    for (const auto& [key, value] : object.items()) {
      // Files name no further files, and ask for no help.
      const bool typed_only = key == "config" || key == "help";
      const CLI::Option* option = typed_only ? nullptr : find_option(*command, key);
      if (option == nullptr) {
        reject(file, key,
               command_name(app, arguments) + " has no such option" +
                   (typed_only ? "" : did_you_mean("--" + key, option_names(*command))));
      }
      words[key] = option_words(*option, value, file, key);
      expanded.origin["--" + key] = file;
    }
  }
  std::vector<std::string> added;
  for (auto& [key, list] : words) {
    if (overruled(*find_option(*command, key), arguments)) {
      expanded.origin.erase("--" + key);
    } else {
      added.insert(added.end(), list.begin(), list.end());
    }
  }
  const auto begin = arguments.begin() + static_cast<std::ptrdiff_t>(commands.size()) - 1;
  arguments.insert(begin, added.begin(), added.end());
  expanded.arguments = std::move(arguments);
  return expanded;
}

}  // namespace sdmt::tools
