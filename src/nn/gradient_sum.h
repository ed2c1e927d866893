// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "sdmt/nn/batch_shards.h"
#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// Adds the gradient of a batch to parameters of a layer: the sums of its shards along the tree,
/// here or, where other processes have some of them, in all of them.
class GradientSum {
 public:
  /// Begins the sum of a batch. Parameters that are frozen take no part.
  void start(const BatchShards& shards, std::vector<Parameter*> parameters);

  /// Called for the images [first, first + count), counted from the first that is here, with an
  /// array for each parameter, null for a frozen one, for their sums: to be set, or each value to
  /// be changed by one addition.
  using Shard =
      std::function<void(int first, int count, bool add, const std::vector<float*>& sums)>;
  void add_shards(const Shard& shard) { add_shards(shard, add_in_place); }
  /// The same where the shards' sums are in another order than the gradient: place() adds them to
  /// it.
  using Place = std::function<void(int parameter, std::span<const float> sums, float* gradient)>;
  void add_shards(const Shard& shard, const Place& place);
  /// What add_shards() does by itself: where the sum of node `node`, an index to
  /// shard_nodes(shards.first(), shards.end()), is to be added for parameter `parameter`.
  float* target(int node, int parameter);

  /// Sends what others need. The gradients are complete after ProcessGroup::wait().
  void finish();

 private:
  static void add_in_place(int parameter, std::span<const float> sums, float* gradient);
  std::size_t row() const { return offsets_.back(); }
  bool alone() const { return shards_->group().size() == 1; }

  std::optional<BatchShards> shards_;
  std::vector<Parameter*> parameters_;
  std::vector<std::size_t> offsets_;  // of the parameters in a row; last its length
  std::vector<float> nodes_;          // a row for each node, where there are other processes
};

}  // namespace sdmt::nn
