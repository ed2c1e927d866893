// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace sdmt::nn {

/// Processes that train one network together, each with some shards of every batch (BatchShards).
/// All of them make the same calls in the same order. What comes of a call is the same bytes in all
/// of them and for any number of them. Calls come from one thread. They throw std::runtime_error
/// when another process has failed or left.
class ProcessGroup {
 public:
  /// 0 <= rank < size, 1 <= size <= kShards; std::invalid_argument otherwise.
  ProcessGroup(int rank, int size);
  virtual ~ProcessGroup() = default;
  ProcessGroup(const ProcessGroup&) = delete;
  ProcessGroup& operator=(const ProcessGroup&) = delete;

  int rank() const { return rank_; }
  int size() const { return size_; }

  /// Everybody's part to everybody: bytes [bounds[r], bounds[r + 1]) are rank r's, who has them
  /// before; all have all of them after. `bounds` has size() + 1 values, which are the same for
  /// all.
  virtual void gather(std::span<std::byte> bytes, std::span<const std::size_t> bounds) = 0;

  /// Rank 0's bytes to everybody.
  virtual void broadcast(std::span<std::byte> bytes) = 0;

  /// Adds to `sums` the sum over all shards, added along the tree over the shards. `nodes` holds
  /// what this process has of it, a row for each of its shard_nodes(), as many values as the sums
  /// have together, the same for all. Returns at once; until wait(), nodes must stay as they are
  /// and sums must not be used.
  virtual void reduce(std::span<const float> nodes, std::vector<std::span<float>> sums) = 0;
  /// Until every reduce() is done.
  virtual void wait() = 0;

  /// A group of one.
  static ProcessGroup& alone();

 private:
  int rank_;
  int size_;
};

}  // namespace sdmt::nn
