// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sdmt/nn/process_group.h"

namespace sdmt::mpi {

/// The processes that an MPI launcher (mpirun, srun) started together, at most one object in a
/// program's life. What reduce() starts goes on in a thread of its own while the caller computes.
/// Every sum is made here, in the order of the tree: none is MPI's.
class MpiGroup : public nn::ProcessGroup {
 public:
  /// Initialises MPI. Throws std::runtime_error when MPI cannot be, std::invalid_argument for more
  /// processes than shards.
  static std::unique_ptr<MpiGroup> join();
  /// Finalises MPI after leave(); otherwise the launcher learns of the failure when this process
  /// ends with a code other than 0, and ends the others.
  ~MpiGroup() override;

  void gather(std::span<std::byte> bytes, std::span<const std::size_t> bounds) override;
  void broadcast(std::span<std::byte> bytes) override;
  void reduce(std::span<const float> nodes, std::vector<std::span<float>> sums) override;
  void wait() override;

  /// Nothing is called any more. Waits until all have left.
  void leave();
  /// Tells rank 0, whose next call throws std::runtime_error with this process's rank, machine and
  /// message. Never throws; does nothing in rank 0 itself.
  void fail(std::string_view message) noexcept;

  /// The machine.
  const std::string& host() const;
  /// Bytes that this process has sent to others.
  std::int64_t bytes_sent() const;

 private:
  struct State;
  explicit MpiGroup(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace sdmt::mpi
