// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

namespace sdmt::tools {

/// While one lives, the first SIGINT or SIGTERM only sets a flag, so that long work can stop
/// between two steps and write what is final; a second one ends the process at once. At most one at
/// a time.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  bool requested() const;

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

/// The signal that came while a StopSignal lived, 0 when none did. The binary then exits with
/// 128 + signal.
int received_stop_signal();

}  // namespace sdmt::tools
