// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <exception>
#include <memory>

#include "sdmt/nn/process_group.h"

namespace sdmt::tools {

/// Which of the processes that a launcher (mpirun, srun) started together this one is, as far as
/// its environment tells: 0 where there is none.
int launched_rank();
/// For a process that has said why it fails, before it ends: the launcher then ends all others and
/// itself, and may lose what it has not passed on by then. Waits a moment where there is a
/// launcher.
void let_launcher_pass_on();

/// The processes that work on one command together: those of the launcher, or this one alone. While
/// it lives, only the first prints.
class Processes {
 public:
  /// Throws std::runtime_error when there are others but this binary was built without MPI, and
  /// std::invalid_argument when they do not give the same bits: binaries, C libraries or
  /// instruction sets differ.
  Processes();
  ~Processes();
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  nn::ProcessGroup& group() const { return *group_; }
  bool is_first() const { return group_->rank() == 0; }
  /// Whether it is true in any of them.
  bool any(bool here) const;
  /// Bytes that this process has sent to others.
  std::int64_t bytes_sent() const;
  /// Waits for all, at the end of the work.
  void leave();
  /// Tells the first, which ends all with the message. Does nothing in the first itself.
  void fail(const std::exception& error) noexcept;

 private:
  std::unique_ptr<nn::ProcessGroup> own_;
  nn::ProcessGroup* group_;
};

}  // namespace sdmt::tools
