// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace sdmt::tools {

/// The command line with the options of its --config files written into it.
///
/// A config file is one JSON object. Its keys are long option names of the command without dashes,
/// its values what one would type: {"lambda": 0.5, "boosting": true, "delay": "auto",
/// "sequences": ["a", "b"]}. A later file wins over an earlier one, the command line over all: also
/// a typed option that excludes the file's.
struct ExpandedArguments {
  std::vector<std::string> arguments;         ///< without the program's name, as typed + config
  std::map<std::string, std::string> origin;  ///< "--lambda" -> the file that set it
};

/// `app` holds all commands with their options; `arguments` is the command line without the
/// program's name. Files are found by find_config_file(). Throws std::invalid_argument naming file
/// and key for a file that is no JSON object, an unknown key, or a value of the wrong type.
ExpandedArguments expand_config(const CLI::App& app, std::vector<std::string> arguments);

/// The commands that the arguments begin with, outermost first: the program, synth, scene.
std::vector<const CLI::App*> named_commands(const CLI::App& app,
                                            const std::vector<std::string>& arguments);

/// "sdmt synth scene": the commands that the arguments begin with, for messages.
std::string command_name(const CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace sdmt::tools
