// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mpi.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace sdmt::mpi {

/// Throws std::runtime_error for what an MPI function returned.
inline void check(int result) {
  if (result == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = {};
  int length = 0;
  MPI_Error_string(result, text, &length);
  throw std::runtime_error("another process cannot be reached: " + std::string(text));
}

/// Messages under way. Those of one tag arrive in the order in which they were sent.
class Requests {
 public:
  void send(std::span<const std::byte> bytes, int to, int tag) {
    for_each_piece(bytes.size(), [&](std::size_t at, int size) {
      check(MPI_Isend(bytes.data() + at, size, MPI_BYTE, to, tag, MPI_COMM_WORLD, add()));
    });
    sent_ += static_cast<std::int64_t>(bytes.size());
  }
  void receive(std::span<std::byte> bytes, int from, int tag) {
    for_each_piece(bytes.size(), [&](std::size_t at, int size) {
      check(MPI_Irecv(bytes.data() + at, size, MPI_BYTE, from, tag, MPI_COMM_WORLD, add()));
    });
  }
  /// Whether all have arrived.
  bool done() {
    if (requests_.empty()) return true;
    int flag = 0;
    check(MPI_Testall(static_cast<int>(requests_.size()), requests_.data(), &flag,
                      MPI_STATUSES_IGNORE));
    if (flag != 0) requests_.clear();
    return flag != 0;
  }
  std::int64_t bytes_sent() const { return sent_; }

 private:
  template <class Run>
  static void for_each_piece(std::size_t size, const Run& run) {
    constexpr std::size_t kLargest = std::size_t{1} << 30;  // a count is an int
    for (std::size_t at = 0; at < size; at += kLargest) {
      run(at, static_cast<int>(std::min(kLargest, size - at)));
    }
  }
  MPI_Request* add() { return &requests_.emplace_back(MPI_REQUEST_NULL); }

  std::vector<MPI_Request> requests_;
  std::int64_t sent_ = 0;
};

}  // namespace sdmt::mpi
