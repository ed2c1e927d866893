// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "manual/command_line.h"

namespace sdmt::tools {

namespace {

std::vector<std::string> option_names(const CommandLine& command) {
  std::vector<std::string> names;
  for (const OptionLine& option : command.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

// The words that can follow `before` as a command: "" gives track, synth, ...; "synth" scene, reid.
std::vector<std::string> words_after(const std::vector<CommandLine>& commands,
                                     const std::string& before) {
  std::vector<std::string> words;
  const std::string prefix = before.empty() ? "" : before + " ";
  for (const CommandLine& command : commands) {
    if (!command.name.starts_with(prefix)) continue;
    const std::string rest = command.name.substr(prefix.size());
    const std::string word = rest.substr(0, rest.find(' '));
    if (words.empty() || words.back() != word) words.push_back(word);
  }
  return words;
}

// In single quotes; `separators` get a backslash too.
std::string shell_word(const std::string& text, const std::string& separators = "") {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
      continue;
    }
    if (separators.find(c) != std::string::npos) out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "'";
}

}  // namespace

std::string bash_completion(const std::vector<CommandLine>& commands) {
  std::string script =
      "# Completion of sdmt for bash, written by `sdmt manual`.\n"
      "_sdmt() {\n"
      "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words=\n"
      "  local command=${COMP_WORDS[1]}\n"
      "  [[ $command == synth && $COMP_CWORD -gt 2 ]] && command=\"synth ${COMP_WORDS[2]}\"\n";
  script += fmt::format(
      "  if ((COMP_CWORD == 1)); then\n    words='{} --help --version'\n"
      "  elif [[ $COMP_CWORD -eq 2 && $command == synth ]]; then\n    words='{}'\n"
      "  else\n    case \"$command $before\" in\n",
      fmt::join(words_after(commands, ""), " "), fmt::join(words_after(commands, "synth"), " "));
  for (const CommandLine& command : commands) {
    for (const OptionLine& option : command.options) {
      for (const std::string& name : option.names) {
        if (!option.words.empty()) {
          script += fmt::format("      '{} {}') words='{}' ;;\n", command.name, name,
                                fmt::join(option.words, " "));
        } else if (!option.value.empty()) {
          script += fmt::format("      '{} {}') return ;;\n", command.name, name);
        }
      }
    }
  }
  script += "    esac\n    [[ -n $words ]] || case $command in\n";
  for (const CommandLine& command : commands) {
    script += fmt::format("      '{}') words='{}' ;;\n", command.name,
                          fmt::join(option_names(command), " "));
  }
  return script +
         "    esac\n  fi\n"
         "  [[ -n $words ]] && COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
         "}\n"
         "complete -o default -F _sdmt sdmt\n";
}

std::string zsh_completion(const std::vector<CommandLine>& commands) {
  constexpr const char* kSpecial = "[]:\\";
  std::string script =
      "#compdef sdmt\n# Completion of sdmt for zsh, written by `sdmt manual`.\n"
      "_sdmt() {\n  local command=$words[2]\n"
      "  [[ $command == synth && $CURRENT -gt 3 ]] && command=\"synth $words[3]\"\n";
  script += fmt::format(
      "  if ((CURRENT == 2)); then\n    compadd {} --help --version\n    return\n"
      "  elif [[ $CURRENT -eq 3 && $command == synth ]]; then\n    compadd {}\n    return\n  fi\n"
      "  case $command in\n",
      fmt::join(words_after(commands, ""), " "), fmt::join(words_after(commands, "synth"), " "));
  for (const CommandLine& command : commands) {
    script += fmt::format("    {})\n      _arguments \\\n", shell_word(command.name));
    for (const OptionLine& option : command.options) {
      std::string action;
      if (!option.value.empty()) {
        action = ":" + option.value + ":";
        if (!option.words.empty()) {
          action += fmt::format("({})", fmt::join(option.words, " "));
        } else if (option.takes_path) {
          action += "_files";
        }
      }
      for (const std::string& name : option.names) {
        script += fmt::format("        '*{}['{}']{}' \\\n", name, shell_word(option.help, kSpecial),
                              action);
      }
    }
    script += "        '*:input:_files'\n      ;;\n";
  }
  return script + "  esac\n}\n_sdmt \"$@\"\n";
}

std::string fish_completion(const std::vector<CommandLine>& commands) {
  std::string script = "# Completion of sdmt for fish, written by `sdmt manual`.\n";
  std::map<std::string, std::string> helps;
  for (const CommandLine& command : commands) helps[command.name] = command.help;
  const auto add = [&](const std::string& before, const std::string& condition) {
    for (const std::string& word : words_after(commands, before)) {
      const std::string name = before.empty() ? word : before + " " + word;
      script += fmt::format("complete -c sdmt -f -n '{}' -a {} -d {}\n", condition, word,
                            shell_word(helps[name]));
    }
  };
  add("", "__fish_use_subcommand");
  add("synth", "__fish_seen_subcommand_from synth; and not __fish_seen_subcommand_from scene reid");
  for (const CommandLine& command : commands) {
    const auto last = command.name.rfind(' ');
    const std::string seen =
        last == std::string::npos ? command.name : command.name.substr(last + 1);
    for (const OptionLine& option : command.options) {
      std::string line = fmt::format("complete -c sdmt -n '__fish_seen_subcommand_from {}'", seen);
      for (const std::string& name : option.names) {
        const bool is_long = name.starts_with("--");
        line += fmt::format(" {} {}", is_long ? "-l" : "-s", name.substr(is_long ? 2 : 1));
      }
      if (!option.value.empty()) line += option.takes_path ? " -r" : " -x";
      if (!option.words.empty()) line += fmt::format(" -a '{}'", fmt::join(option.words, " "));
      script += line + " -d " + shell_word(option.help) + "\n";
    }
  }
  return script;
}

}  // namespace sdmt::tools
