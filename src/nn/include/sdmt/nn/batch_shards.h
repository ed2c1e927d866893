// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sdmt/nn/process_group.h"

namespace sdmt::nn {

/// Shards that every batch is cut into. Sums over the images of a batch are made shard by shard,
/// and those of the shards are added along a binary tree, ((0 + 1) + (2 + 3)) + ...: their bits
/// depend neither on the number of threads nor on that of the processes that share the shards.
inline constexpr int kShards = 16;

/// A subtree of that tree: `count` shards, a power of 2, from `first` on, a multiple of count.
struct ShardNode {
  int first = 0;
  int count = 1;
};

/// Adds up shards, or nodes, that come in order, with as few sums open as possible: a stack of
/// slots, each the sum of a node.
class ShardTree {
 public:
  /// The slot that the next node goes to: the number of open sums.
  int top() const { return static_cast<int>(open_.size()); }
  /// The next node lies in slot top(). Returns how many times the topmost slot is now to be added
  /// to the one below it, whose node then is both.
  int push(ShardNode node);
  /// The nodes of the open slots, from slot 0.
  const std::vector<ShardNode>& nodes() const { return open_; }

 private:
  std::vector<ShardNode> open_;
};

/// The largest nodes that make up shards [first, end), in order.
std::vector<ShardNode> shard_nodes(int first, int end);

/// First shard of process `rank` of `size`; for rank == size, kShards.
int first_shard(int rank, int size);

/// A batch of images, cut into shards, of which this process holds some that follow each other.
/// Tensors hold the images that are here.
class BatchShards {
 public:
  /// The group must outlive it. Throws std::invalid_argument when there are fewer images than
  /// kShards, but for a group of one.
  explicit BatchShards(int images, ProcessGroup& group = ProcessGroup::alone());

  ProcessGroup& group() const { return *group_; }
  /// Of the whole batch.
  int images() const { return images_; }
  /// First image of a shard, counted in the whole batch; shard == kShards: images().
  int begin(int shard) const;
  /// Shards [first(), end()) are here,
  int first() const { return first_; }
  int end() const { return end_; }
  /// the images [begin(first()), begin(end())).
  int images_here() const { return begin(end_) - begin(first_); }

  /// Everybody's rows to everybody: rows of `size` values each, one for each image of the batch.
  void gather_images(std::span<float> rows, std::size_t size) const;
  /// The same for rows of which each shard has one.
  void gather_shards(std::span<double> rows, std::size_t size) const;

 private:
  int images_;
  ProcessGroup* group_;
  int first_;
  int end_;
};

}  // namespace sdmt::nn
