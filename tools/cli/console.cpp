// SPDX-License-Identifier: Apache-2.0
#include "cli/console.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <exception>
#include <new>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/unfinished_files.h"

namespace sdmt::tools {

namespace {

int output_error = 0;           // of standard output, the first
std::FILE* messages = nullptr;  // standard error, once libraries are silenced
bool working = false;
bool silent = false;
bool output_is_result = false;
Verbosity chosen = Verbosity::normal;

#ifdef SDMT_SANITIZED  // the sanitizers' reports come by standard error, too
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// Where what is said to `stream` really goes.
std::FILE* shown_at(std::FILE* stream) {
  if (stream == stdout && output_is_result) stream = stderr;
  return stream == stderr && messages != nullptr ? messages : stream;
}

// The standard library and that for JSON allocate in places that nothing may be thrown from.
bool memory_ran_out() {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    return true;
  } catch (...) {
    return false;
  }
  return false;
}

[[noreturn]] void terminated() {
  const bool out_of_memory = memory_ran_out();
  write_console(stderr,
                out_of_memory ? "sdmt: out of memory\n" : "sdmt: ended by an unexpected error\n");
  io::remove_unfinished_files();
  if (!out_of_memory) std::abort();
  std::_Exit(EXIT_FAILURE);
}

// exit() in the middle of the work is not ours: libgomp calls it when it gets no threads.
void exited() {
  if (!working) return;
  write_console(stderr, "sdmt: ended by a library (out of threads or memory?)\n");
  io::remove_unfinished_files();
}

}  // namespace

void silence_console() { silent = true; }

void write_console(std::FILE* stream, std::string_view text) {
  if (silent) return;
  stream = shown_at(stream);
  if (std::fwrite(text.data(), 1, text.size(), stream) == text.size()) return;
  if (stream == stdout && output_error == 0) output_error = errno;
}

void give_standard_output_to_result() { output_is_result = true; }

void set_verbosity(Verbosity verbosity) {
  chosen = verbosity;
  // Libraries write to the descriptor.
  if (verbosity == Verbosity::verbose && messages != nullptr) {
    ::dup2(::fileno(messages), STDERR_FILENO);
  }
}

Verbosity verbosity() { return chosen; }

int flush_standard_output() {
  if (std::fflush(stdout) != 0 && output_error == 0) output_error = errno;
  if (std::ferror(stdout) != 0 && output_error == 0) output_error = EIO;
  return output_error;
}

void open_standard_streams() {
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    // For reading only: what is written there fails as it would have, instead of vanishing.
    ::open("/dev/null", O_RDONLY);  // takes the lowest number that is free
  }
}

QuietLibraries::QuietLibraries() {
  if (kSanitized) return;
  constexpr int kBehindStandardStreams = STDERR_FILENO + 1;
  const int kept = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, kBehindStandardStreams);
  if (kept < 0) return;
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  std::FILE* stream = nowhere < 0 ? nullptr : ::fdopen(kept, "w");
  if (stream == nullptr) {
    ::close(kept);
    if (nowhere >= 0) ::close(nowhere);
    return;
  }
  std::setvbuf(stream, nullptr, _IONBF, 0);
  messages = stream;
  ::dup2(nowhere, STDERR_FILENO);
  ::close(nowhere);
  working = true;
  std::set_terminate(terminated);
  std::atexit(exited);
}

QuietLibraries::~QuietLibraries() { working = false; }

std::optional<int> console_width(std::FILE* stream) {
  constexpr int kMost = 10000;
  if (const char* columns = std::getenv("COLUMNS"); columns != nullptr) {
    const auto width = io::parse_number<int>(columns);
    if (width && *width > 0 && *width <= kMost) return width;
  }
  winsize size{};
  if (::ioctl(::fileno(shown_at(stream)), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return {};
  return size.ws_col;
}

bool is_terminal() { return ::isatty(::fileno(shown_at(stderr))) != 0; }

}  // namespace sdmt::tools
