// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "requests.h"

namespace sdmt::mpi {

/// One reduce() under way. Each process adds up a slice of the values: it gets the nodes' slices
/// from the others and sends them the sum. So every process sends and receives the values about
/// twice, however many there are.
class Reduction {
 public:
  /// `tag` and the next belong to it.
  Reduction(int rank, int size, int tag, std::span<const float> nodes,
            std::vector<std::span<float>> sums);

  /// Goes on with what has arrived; true once the sums are complete.
  bool advance();
  std::int64_t bytes_sent() const { return requests_.bytes_sent(); }

 private:
  std::size_t slice_begin(int rank) const { return values_ * rank / size_; }
  std::size_t slice_size(int rank) const { return slice_begin(rank + 1) - slice_begin(rank); }
  void exchange_nodes();
  void add_slice();
  void exchange_sums();
  void finish();

  enum class Phase { nodes, sums, done };
  int rank_;
  int size_;
  int tag_;
  std::size_t values_;
  std::span<const float> nodes_;
  std::vector<std::span<float>> sums_;
  std::vector<float> slices_;  // of this process, one for each node of all processes
  std::vector<float> total_;
  Requests requests_;
  Phase phase_ = Phase::nodes;
};

}  // namespace sdmt::mpi
