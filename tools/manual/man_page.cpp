// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "manual/command_line.h"

namespace sdmt::tools {

namespace {

// Text that roff takes as it is.
std::string escaped(const std::string& text) {
  std::string roff;
  for (const char c : text) {
    if (c == '\\') {
      roff += "\\e";
    } else if (c == '-') {
      roff += "\\-";
    } else {
      roff += c == '\n' ? ' ' : c;
    }
  }
  if (!roff.empty() && (roff[0] == '.' || roff[0] == '\'')) roff.insert(0, "\\&");
  return roff;
}

std::string dashed(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string begin_page(const std::string& page, const std::string& about,
                       const std::string& version) {
  return fmt::format(".TH {} 1 \"\" \"sdmt {}\" \"sdmt\"\n.SH NAME\n{} \\- {}\n", escaped(page),
                     version, escaped(page), escaped(about));
}

std::string option_item(const OptionLine& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += (names.empty() ? "" : ", ") + fmt::format("\\fB{}\\fR", escaped(name));
  }
  if (!option.value.empty()) {
    names += (names.empty() ? "" : " ") + fmt::format("\\fI{}\\fR", escaped(option.value));
  }
  const std::string required = option.required ? " (required)" : "";
  return fmt::format(".TP\n{}\n{}{}\n", names, escaped(option.help), required);
}

}  // namespace

std::string man_page(const CommandLine& command, const std::string& version) {
  std::string page = begin_page("sdmt-" + dashed(command.name), command.help, version);
  page += fmt::format(".SH SYNOPSIS\n\\fBsdmt {}\\fR", escaped(command.name));
  for (const OptionLine& argument : command.arguments) {
    page += fmt::format(" \\fI{}\\fR", escaped(argument.value));
  }
  page += " [\\fIoptions\\fR]\n";
  std::string group;
  for (const auto* lines : {&command.arguments, &command.options}) {
    for (const OptionLine& option : *lines) {
      const std::string title = option.names.empty() ? "Arguments" : option.group;
      if (title != group) {
        group = title;
        page += fmt::format(".SH \"{}\"\n", escaped(group));
      }
      page += option_item(option);
    }
  }
  return page +
         ".SH \"EXIT STATUS\"\n0: done. 1: failed while running. 2: an argument or an input is "
         "wrong. The message says what, where, and what was expected.\n.SH \"SEE ALSO\"\n"
         "\\fBsdmt\\fR(1)\n";
}

std::string overview_page(const std::string& about, const std::vector<CommandLine>& commands,
                          const std::string& version) {
  std::string page = begin_page("sdmt", about, version) +
                     ".SH SYNOPSIS\n\\fBsdmt\\fR \\fIcommand\\fR [\\fIoptions\\fR]\n"
                     ".SH COMMANDS\n";
  for (const CommandLine& command : commands) {
    page +=
        fmt::format(".TP\n\\fBsdmt {}\\fR\n{}; see \\fBsdmt\\-{}\\fR(1)\n", escaped(command.name),
                    escaped(command.help), escaped(dashed(command.name)));
  }
  return page +
         ".SH ENVIRONMENT\n.TP\n\\fBSDMT_SHARE_DIR\\fR\nFolder of the shipped models and "
         "configurations, in place of share/sdmt beside the binary\n";
}

}  // namespace sdmt::tools
