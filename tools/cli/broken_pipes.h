// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <csignal>

namespace sdmt::tools {

/// In this thread and those that it starts, a connection whose other side has left is an error of
/// the write, and no SIGPIPE, which tells that nobody reads our standard output any more.
inline void keep_broken_pipes_quiet() {
  sigset_t pipe;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, nullptr);
}

}  // namespace sdmt::tools
