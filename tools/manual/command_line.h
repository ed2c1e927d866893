// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace sdmt::tools {

/// An option as manuals tell it.
struct OptionLine {
  std::vector<std::string> names;  ///< "--output", "-h"; of an argument without dashes: none
  std::string value;               ///< what stands for its value, "FILE"; empty for switches
  std::string help;
  std::string group;
  std::vector<std::string> words;  ///< that the value can be, where they are few; else empty
  bool takes_path = false;
  bool required = false;
};

/// A command that does work, as the parser knows it.
struct CommandLine {
  std::string name;  ///< "track", "synth scene"
  std::string help;
  std::vector<OptionLine> arguments;  ///< those without dashes
  std::vector<OptionLine> options;
};

/// All of them, in the order of the help; `app` is the whole program.
std::vector<CommandLine> command_lines(const CLI::App& app);

/// The page sdmt-NAME(1), and sdmt(1), which lists the commands.
std::string man_page(const CommandLine& command, const std::string& version);
std::string overview_page(const std::string& about, const std::vector<CommandLine>& commands,
                          const std::string& version);

std::string bash_completion(const std::vector<CommandLine>& commands);
std::string zsh_completion(const std::vector<CommandLine>& commands);
std::string fish_completion(const std::vector<CommandLine>& commands);

}  // namespace sdmt::tools
