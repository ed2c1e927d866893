// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/batch_shards.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdmt::nn {

namespace {

class Alone : public ProcessGroup {
 public:
  Alone() : ProcessGroup(0, 1) {}
  void gather(std::span<std::byte>, std::span<const std::size_t>) override {}
  void broadcast(std::span<std::byte>) override {}
  void reduce(std::span<const float> nodes, std::vector<std::span<float>> sums) override {
    for (const std::span<float> sum : sums) {
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += nodes[i];
      nodes = nodes.subspan(sum.size());
    }
  }
  void wait() override {}
};

}  // namespace

ProcessGroup::ProcessGroup(int rank, int size) : rank_(rank), size_(size) {
  if (size >= 1 && size <= kShards && rank >= 0 && rank < size) return;
  throw std::invalid_argument("process " + std::to_string(rank) + " of " + std::to_string(size) +
                              ", expected 1 to " + std::to_string(kShards) + " processes");
}

ProcessGroup& ProcessGroup::alone() {
  static Alone group;
  return group;
}

int ShardTree::push(ShardNode node) {
  int merges = 0;
  open_.push_back(node);
  while (open_.size() > 1) {
    ShardNode& left = open_[open_.size() - 2];
    const ShardNode right = open_.back();
    if (left.count != right.count || left.first % (2 * left.count) != 0) break;
    left.count *= 2;
    open_.pop_back();
    ++merges;
  }
  return merges;
}

std::vector<ShardNode> shard_nodes(int first, int end) {
  ShardTree tree;
  for (int shard = first; shard < end; ++shard) tree.push({shard, 1});
  return tree.nodes();
}

int first_shard(int rank, int size) { return rank * kShards / size; }

BatchShards::BatchShards(int images, ProcessGroup& group)
    : images_(images),
      group_(&group),
      first_(first_shard(group.rank(), group.size())),
      end_(first_shard(group.rank() + 1, group.size())) {
  if (group.size() == 1 || images >= kShards) return;
  throw std::invalid_argument("a batch of " + std::to_string(images) +
                              " images cannot be shared by " + std::to_string(group.size()) +
                              " processes, expected at least " + std::to_string(kShards));
}

int BatchShards::begin(int shard) const {
  return static_cast<int>(std::int64_t{images_} * shard / kShards);
}

void BatchShards::gather_images(std::span<float> rows, std::size_t size) const {
  std::vector<std::size_t> bounds;
  for (int rank = 0; rank <= group_->size(); ++rank) {
    bounds.push_back(begin(first_shard(rank, group_->size())) * size * sizeof(float));
  }
  group_->gather(std::as_writable_bytes(rows), bounds);
}

void BatchShards::gather_shards(std::span<double> rows, std::size_t size) const {
  std::vector<std::size_t> bounds;
  for (int rank = 0; rank <= group_->size(); ++rank) {
    bounds.push_back(first_shard(rank, group_->size()) * size * sizeof(double));
  }
  group_->gather(std::as_writable_bytes(rows), bounds);
}

}  // namespace sdmt::nn
