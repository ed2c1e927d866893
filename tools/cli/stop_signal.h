// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <csignal>

namespace sdmt::tools {

/// While one lives, the first SIGINT, SIGTERM, SIGHUP (the terminal was closed; not under nohup) or
/// SIGPIPE (who reads our output has left) only sets a flag, so that long work can stop between two
/// steps and write what is final; a second one, but for SIGPIPE, ends the process at once. At most
/// one at a time.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  bool requested() const;

 private:
  static constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP, SIGPIPE};

  std::array<struct sigaction, kSignals.size()> old_{};
};

/// Thrown out of long work whose end nobody wants any more.
struct Stopped {};

/// The signal that came while a StopSignal lived, 0 when none did. The binary then exits with
/// 128 + signal.
int received_stop_signal();

}  // namespace sdmt::tools
