// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>

namespace sdmt::io {

/// The result of a system call, made again as long as a signal interrupts it.
template <typename Call>
auto retry(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

}  // namespace sdmt::io
