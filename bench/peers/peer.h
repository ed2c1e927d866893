// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <sstream>
#include <string>

#include "sdmt/nn/tensor.h"

// What compare.py asks of a peer, line by line on standard input, and its answers, line by line on
// standard output:
//   embed BATCH      milliseconds of one forward pass
//   values BATCH     the embeddings of the first and the last patch, 2 x 128 numbers
//   train BATCH all|frozen    milliseconds of one training step
// A peer that cannot do something answers "none".

namespace sdmt::peers {

/// The patches that every peer embeds: [batch, 128, 64, 3], value i from the bits of i *
/// 2654435761.
inline nn::Tensor patches(int batch) {
  nn::Tensor tensor({batch, 128, 64, 3});
  for (std::size_t i = 0; i < tensor.size(); ++i) {
    const auto bits = static_cast<std::uint32_t>(i) * 2654435761U;
    tensor.data()[i] = static_cast<float>(bits >> 8 & 0xffffU) / 16384.0F - 2.0F;
  }
  return tensor;
}

/// Wall-clock time, or CPU time when the environment has PEER_CPU_TIME: with one thread, what the
/// work costs even on a machine that is busy with other things.
inline double milliseconds(const std::function<void()>& work) {
  static const bool cpu_time = std::getenv("PEER_CPU_TIME") != nullptr;
  const auto now = [] {
    timespec time;
    clock_gettime(cpu_time ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &time);
    return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
  };
  const double start = now();
  work();
  return now() - start;
}

inline void print_values(const float* first, const float* last, int count) {
  for (const float* row : {first, last}) {
    for (int i = 0; i < count; ++i) std::printf("%.9g ", static_cast<double>(row[i]));
  }
  std::printf("\n");
}

/// Answers until standard input ends. `answer` prints one line, and returns false for a question
/// that it cannot answer.
inline void serve(const std::function<bool(const std::string& what, int batch,
                                           const std::string& mode)>& answer) {
  std::string line;
  while (std::getline(std::cin, line)) {
    std::istringstream words(line);
    std::string what;
    std::string mode;
    int batch = 0;
    words >> what >> batch >> mode;
    if (!answer(what, batch, mode)) std::printf("none\n");
    std::fflush(stdout);
  }
}

}  // namespace sdmt::peers
