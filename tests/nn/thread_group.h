// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omp.h>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "sdmt/nn/batch_shards.h"

namespace sdmt::nn {

/// A process group whose processes are threads of this one, with the plainest sums there are.
class ThreadGroup : public ProcessGroup {
 public:
  /// std::barrier spins, which sixteen threads on two cores must not.
  class Barrier {
   public:
    explicit Barrier(int size) : size_(size) {}
    void arrive_and_wait() {
      std::unique_lock lock(mutex_);
      const int round = round_;
      if (++arrived_ >= size_) return open();
      changed_.wait(lock, [&] { return round != round_; });
    }
    void arrive_and_drop() {
      const std::scoped_lock lock(mutex_);
      --size_;
      if (arrived_ >= size_) open();
    }

   private:
    void open() {
      arrived_ = 0;
      ++round_;
      changed_.notify_all();
    }
    std::mutex mutex_;
    std::condition_variable changed_;
    int size_;
    int arrived_ = 0;
    int round_ = 0;
  };

  struct Shared {
    explicit Shared(int size)
        : barrier(size), bytes(static_cast<std::size_t>(size)), nodes(bytes.size()) {}
    Barrier barrier;
    std::vector<std::span<std::byte>> bytes;
    std::vector<std::span<const float>> nodes;
  };

  ThreadGroup(int rank, int size, Shared& shared) : ProcessGroup(rank, size), shared_(shared) {}

  void gather(std::span<std::byte> bytes, std::span<const std::size_t> bounds) override {
    shared_.bytes[rank()] = bytes;
    shared_.barrier.arrive_and_wait();
    for (int r = 0; r < size(); ++r) {
      if (r == rank()) continue;
      const auto part = shared_.bytes[r].subspan(bounds[r], bounds[r + 1] - bounds[r]);
      std::ranges::copy(part, bytes.begin() + static_cast<std::ptrdiff_t>(bounds[r]));
    }
    shared_.barrier.arrive_and_wait();
  }

  void broadcast(std::span<std::byte> bytes) override {
    shared_.bytes[rank()] = bytes;
    shared_.barrier.arrive_and_wait();
    if (rank() > 0) std::ranges::copy(shared_.bytes[0], bytes.begin());
    shared_.barrier.arrive_and_wait();
  }

  void reduce(std::span<const float> nodes, std::vector<std::span<float>> sums) override {
    shared_.nodes[rank()] = nodes;
    shared_.barrier.arrive_and_wait();
    Rows rows;
    for (int r = 0; r < size(); ++r) {
      const auto of_rank = shard_nodes(first_shard(r, size()), first_shard(r + 1, size()));
      const std::size_t values = nodes.size() / shard_nodes_here();
      for (std::size_t i = 0; i < of_rank.size(); ++i) {
        rows[{of_rank[i].first, of_rank[i].count}] = shared_.nodes[r].subspan(i * values, values);
      }
    }
    const std::vector<float> all = total(rows, 0, kShards);
    std::size_t at = 0;
    for (const std::span<float> sum : sums) {
      for (float& value : sum) value += all[at++];
    }
    shared_.barrier.arrive_and_wait();
  }

  void wait() override {}

  /// Calls run(group) in `size` threads. An exception of any is thrown again.
  static void run(int size, const std::function<void(ProcessGroup&)>& work) {
    Shared shared(size);
    std::vector<std::exception_ptr> errors(static_cast<std::size_t>(size));
    std::vector<std::thread> threads;
    for (int rank = 0; rank < size; ++rank) {
      threads.emplace_back([&, rank] {
        omp_set_num_threads(1);
        ThreadGroup group(rank, size, shared);
        try {
          work(group);
        } catch (...) {
          errors[rank] = std::current_exception();
          shared.barrier.arrive_and_drop();
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (const auto& error : errors) {
      if (error) std::rethrow_exception(error);
    }
  }

 private:
  using Rows = std::map<std::pair<int, int>, std::span<const float>>;  // by first and count

  std::size_t shard_nodes_here() const {
    return shard_nodes(first_shard(rank(), size()), first_shard(rank() + 1, size())).size();
  }

  static std::vector<float> total(const Rows& rows, int first, int count) {
    if (const auto found = rows.find({first, count}); found != rows.end()) {
      return {found->second.begin(), found->second.end()};
    }
    auto left = total(rows, first, count / 2);
    const auto right = total(rows, first + count / 2, count / 2);
    for (std::size_t i = 0; i < left.size(); ++i) left[i] += right[i];
    return left;
  }

  Shared& shared_;
};

}  // namespace sdmt::nn
