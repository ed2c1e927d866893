// SPDX-License-Identifier: Apache-2.0
#include "reduction.h"

#include <algorithm>
#include <utility>

#include "sdmt/nn/batch_shards.h"

namespace sdmt::mpi {

namespace {

std::vector<nn::ShardNode> nodes_of(int rank, int size) {
  return nn::shard_nodes(nn::first_shard(rank, size), nn::first_shard(rank + 1, size));
}

}  // namespace

Reduction::Reduction(int rank, int size, int tag, std::span<const float> nodes,
                     std::vector<std::span<float>> sums)
    : rank_(rank),
      size_(size),
      tag_(tag),
      values_(nodes.size() / nodes_of(rank, size).size()),
      nodes_(nodes),
      sums_(std::move(sums)) {
  exchange_nodes();
}

void Reduction::exchange_nodes() {
  const std::size_t slice = slice_size(rank_);
  std::size_t rows = 0;
  for (int rank = 0; rank < size_; ++rank) rows += nodes_of(rank, size_).size();
  slices_.resize(rows * slice);
  std::size_t row = 0;
  for (int rank = 0; rank < size_; ++rank) {
    const std::size_t count = nodes_of(rank, size_).size();
    for (std::size_t i = 0; i < count; ++i, ++row) {
      const std::span<float> to(slices_.data() + row * slice, slice);
      if (rank == rank_) {
        std::copy_n(nodes_.data() + i * values_ + slice_begin(rank_), slice, to.begin());
      } else {
        requests_.receive(std::as_writable_bytes(to), rank, tag_);
      }
    }
  }
  // The neighbour first, so that not all send to the same at once.
  for (int step = 1; step < size_; ++step) {
    const int to = (rank_ + step) % size_;
    for (std::size_t at = slice_begin(to); at < nodes_.size(); at += values_) {
      requests_.send(std::as_bytes(nodes_.subspan(at, slice_size(to))), to, tag_);
    }
  }
}

void Reduction::add_slice() {
  const std::size_t slice = slice_size(rank_);
  nn::ShardTree tree;
  std::vector<float*> open;
  std::size_t row = 0;
  for (int rank = 0; rank < size_; ++rank) {
    for (const nn::ShardNode node : nodes_of(rank, size_)) {
      open.push_back(slices_.data() + row++ * slice);
      for (int merges = tree.push(node); merges > 0; --merges) {
        const float* const from = open.back();
        open.pop_back();
        float* const to = open.back();
        for (std::size_t i = 0; i < slice; ++i) to[i] += from[i];
      }
    }
  }
  total_.resize(values_);
  std::copy_n(open.front(), slice,
              total_.begin() + static_cast<std::ptrdiff_t>(slice_begin(rank_)));
}

void Reduction::exchange_sums() {
  const std::span<float> total = total_;
  for (int step = 1; step < size_; ++step) {
    const int to = (rank_ + step) % size_;
    const int from = (rank_ + size_ - step) % size_;
    requests_.receive(std::as_writable_bytes(total.subspan(slice_begin(from), slice_size(from))),
                      from, tag_ + 1);
    requests_.send(std::as_bytes(total.subspan(slice_begin(rank_), slice_size(rank_))), to,
                   tag_ + 1);
  }
}

void Reduction::finish() {
  const float* from = total_.data();
  for (const std::span<float> sum : sums_) {
    for (float& value : sum) value += *from++;
  }
}

bool Reduction::advance() {
  if (phase_ == Phase::nodes && requests_.done()) {
    add_slice();
    exchange_sums();
    phase_ = Phase::sums;
  }
  if (phase_ == Phase::sums && requests_.done()) {
    finish();
    phase_ = Phase::done;
  }
  return phase_ == Phase::done;
}

}  // namespace sdmt::mpi
