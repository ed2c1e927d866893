// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "sdmt/io/checked_value.h"

namespace sdmt::tools {

/// Text for whoever watches. Never throws: work of hours must not end because the disk of a log is
/// full or the reader of a pipe has left. main() reports at the end what standard output did not
/// take.
void write_console(std::FILE* stream, std::string_view text);

/// Formats and writes; whatever file a text came from, it cannot command the terminal.
template <typename... Args>
void say(std::FILE* stream, fmt::format_string<Args...> text, Args&&... args) {
  const std::string said = fmt::format(text, std::forward<Args>(args)...);
  write_console(stream, io::printable(said, said.size(), "\n\r\t"));
}

/// Says to standard error what a command of that name, a literal, does otherwise than one might
/// think.
inline auto warning_of(std::string_view command) {
  return
      [command](const std::string& text) { say(stderr, "sdmt {}: warning: {}\n", command, text); };
}

/// From now on nothing is written: this is one of several processes that do the same work.
void silence_console();

/// How much a run says beside its result. --quiet: warnings and errors alone. --verbose: also what
/// is used, and what the libraries below say.
enum class Verbosity { quiet, normal, verbose };
void set_verbosity(Verbosity verbosity);
Verbosity verbosity();

/// say(stdout), of how a run goes and went; not when quiet.
template <typename... Args>
void note(fmt::format_string<Args...> text, Args&&... args) {
  if (verbosity() != Verbosity::quiet) say(stdout, text, std::forward<Args>(args)...);
}

/// say(stderr), of what a run uses; only when verbose.
template <typename... Args>
void detail(fmt::format_string<Args...> text, Args&&... args) {
  if (verbosity() == Verbosity::verbose) say(stderr, text, std::forward<Args>(args)...);
}

/// From now on what is said to standard output goes to standard error: a result is written there.
void give_standard_output_to_result();

/// Writes what is still buffered; 0, or the errno with which standard output failed, now or before.
int flush_standard_output();

/// Puts /dev/null in place of those of descriptors 0 to 2 that are closed. Otherwise the next file
/// that is opened would get the number, and with it the messages meant for the terminal.
void open_standard_streams();

/// While it lives, standard error is for the messages of this program: what libraries under it
/// print there by themselves (decoders of images and videos do) goes to /dev/null, while say() and
/// write_console() still reach it. Should a library end the program meanwhile, that is said. Made
/// once, before any thread.
class QuietLibraries {
 public:
  QuietLibraries();
  ~QuietLibraries();
  QuietLibraries(const QuietLibraries&) = delete;
  QuietLibraries& operator=(const QuietLibraries&) = delete;
};

/// Columns of the terminal that shows what is said to `stream`: the environment variable COLUMNS,
/// else as the terminal answers. Nothing where there is neither: a file or a pipe has no width.
std::optional<int> console_width(std::FILE* stream);

/// Whether messages are shown by a terminal.
bool is_terminal();

}  // namespace sdmt::tools
