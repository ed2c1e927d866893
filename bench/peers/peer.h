// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
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

inline double milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
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
