// SPDX-License-Identifier: Apache-2.0
#include "cli/console.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace sdmt::tools {

namespace {

int output_error = 0;  // of standard output, the first

}  // namespace

void write_console(std::FILE* stream, std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stream) == text.size()) return;
  if (stream == stdout && output_error == 0) output_error = errno;
}

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

}  // namespace sdmt::tools
