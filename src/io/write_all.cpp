// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/write_all.h"

#include <unistd.h>

#include <cerrno>

#include "sdmt/io/retry.h"

namespace sdmt::io {

std::size_t write_all(int descriptor, std::string_view bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written =
        retry([&] { return ::write(descriptor, bytes.data() + done, bytes.size() - done); });
    if (written == 0) errno = EIO;
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  return done;
}

}  // namespace sdmt::io
