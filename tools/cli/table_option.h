// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "sdmt/io/option_table.h"

namespace sdmt::tools {

/// Adds an entry of a table of options to the command, a switch also as --no-NAME. `options` and
/// the table must live until the command line is parsed. What Options::validate() refuses is
/// reported with the option.
template <typename Options>
CLI::Option* add_table_option(CLI::App& command, Options& options,
                              const io::Option<Options>& entry) {
  const std::string flag = "--" + entry.name;
  const auto set = [&options, &entry, flag](const std::string& text) {
    try {
      entry.set(options, text);
      options.validate();  // here, where the option is known by its name
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError(flag, error.what());
    }
  };
  if (entry.is_switch) {
    return command.add_flag_function(
        flag + ",!--no-" + entry.name,
        [set](std::int64_t count) { set(count > 0 ? "true" : "false"); },
        entry.help + " [" + entry.shown(options) + "]");
  }
  const std::string space = entry.help.empty() ? "" : " ";
  return command
      .add_option_function<std::string>(flag, set, entry.help + space + "(" + entry.values + ")")
      ->type_name("")
      ->default_str(entry.get(options));
}

}  // namespace sdmt::tools
