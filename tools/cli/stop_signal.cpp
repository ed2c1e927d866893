// SPDX-License-Identifier: Apache-2.0
#include "cli/stop_signal.h"

namespace sdmt::tools {

namespace {

volatile std::sig_atomic_t received = 0;

extern "C" void remember_signal(int signal) { received = signal; }

}  // namespace

StopSignal::StopSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction action {};
    action.sa_handler = remember_signal;
    // Reads and writes that the handler interrupts go on. It serves once; only a pipe may break
    // again while what is final is written.
    action.sa_flags = SA_RESTART;
    if (kSignals[i] != SIGPIPE) action.sa_flags |= static_cast<int>(SA_RESETHAND);
    sigaction(kSignals[i], &action, &old_[i]);
    // nohup asks not to be told that the terminal has gone.
    if (kSignals[i] == SIGHUP && old_[i].sa_handler == SIG_IGN) {
      sigaction(SIGHUP, &old_[i], nullptr);
    }
  }
}

StopSignal::~StopSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &old_[i], nullptr);
}

bool StopSignal::requested() const { return received != 0; }

int received_stop_signal() { return received; }

}  // namespace sdmt::tools
