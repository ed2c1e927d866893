// SPDX-License-Identifier: Apache-2.0
#include "gradient_sum.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "kernels/scratch.h"
#include "parameter_access.h"

namespace sdmt::nn {

namespace {

constexpr std::int64_t kWorthThreads = 1 << 15;

void add(const float* from, std::int64_t size, float* to) {
#pragma omp parallel for simd schedule(static) if (size > kWorthThreads)
  for (std::int64_t i = 0; i < size; ++i) to[i] += from[i];
}

void clear(float* to, std::int64_t size) {
#pragma omp parallel for simd schedule(static) if (size > kWorthThreads)
  for (std::int64_t i = 0; i < size; ++i) to[i] = 0.0F;
}

}  // namespace

void GradientSum::start(const BatchShards& shards, std::vector<Parameter*> parameters) {
  shards_ = shards;
  parameters_ = std::move(parameters);
  offsets_.assign(1, 0);
  for (const Parameter* parameter : parameters_) {
    offsets_.push_back(row() + (parameter->trainable ? parameter->value.size() : 0));
  }
  if (alone()) return;
  nodes_.resize(shard_nodes(shards.first(), shards.end()).size() * row());
  clear(nodes_.data(), static_cast<std::int64_t>(nodes_.size()));
}

float* GradientSum::target(int node, int parameter) {
  if (!parameters_[parameter]->trainable) return nullptr;
  if (alone()) return gradient_of(*parameters_[parameter]);
  return nodes_.data() + node * row() + offsets_[parameter];
}

void GradientSum::add_in_place(int /*parameter*/, std::span<const float> sums, float* gradient) {
  add(sums.data(), static_cast<std::int64_t>(sums.size()), gradient);
}

void GradientSum::add_shards(const Shard& shard, const Place& place) {
  if (row() == 0) return;
  const auto size = static_cast<std::int64_t>(row());
  const int first_image = shards_->begin(shards_->first());
  ShardTree tree;
  // A sum of 16 has five open at most, one of fewer shards no more than that.
  float* const slots = thread_scratch(ScratchUse::shards, 5 * row());
  std::vector<float*> sums(parameters_.size());
  for (int s = shards_->first(); s < shards_->end(); ++s) {
    const int top = tree.top();
    int merges = tree.push({s, 1});
    // One that is merged at once is added to the sum that it is merged with.
    const int slot = merges > 0 ? top - 1 : top;
    float* const to = slots + slot * size;
    for (std::size_t p = 0; p < sums.size(); ++p) {
      sums[p] = parameters_[p]->trainable ? to + offsets_[p] : nullptr;
    }
    const int begin = shards_->begin(s), end = shards_->begin(s + 1);
    if (begin < end) {
      shard(begin - first_image, end - begin, slot < top, sums);
    } else if (slot == top) {
      clear(to, size);
    }
    for (int at = slot; merges > 1; --merges, --at) {
      add(slots + at * size, size, slots + (at - 1) * size);
    }
  }
  for (int node = 0; node < tree.top(); ++node) {
    for (int p = 0; p < static_cast<int>(parameters_.size()); ++p) {
      const std::span<const float> sums_of_node(slots + node * size + offsets_[p],
                                                offsets_[p + 1] - offsets_[p]);
      if (!sums_of_node.empty()) place(p, sums_of_node, target(node, p));
    }
  }
}

void GradientSum::finish() {
  if (alone() || row() == 0) return;
  std::vector<std::span<float>> sums;
  for (Parameter* parameter : parameters_) {
    if (!parameter->trainable) continue;
    sums.emplace_back(gradient_of(*parameter), parameter->value.size());
  }
  shards_->group().reduce(nodes_, std::move(sums));
}

}  // namespace sdmt::nn
