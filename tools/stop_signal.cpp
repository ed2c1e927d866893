// SPDX-License-Identifier: Apache-2.0
#include "stop_signal.h"

namespace sdmt::tools {

namespace {

volatile std::sig_atomic_t received = 0;

extern "C" void remember_signal(int signal) { received = signal; }

}  // namespace

StopSignal::StopSignal() {
  struct sigaction action {};
  action.sa_handler = remember_signal;
  // The handler serves once; reads and writes that it interrupts go on.
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

StopSignal::~StopSignal() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool StopSignal::requested() const { return received != 0; }

int received_stop_signal() { return received; }

}  // namespace sdmt::tools
