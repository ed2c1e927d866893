// SPDX-License-Identifier: Apache-2.0
#include "kernels/scratch.h"

#include <array>

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

float* thread_scratch(ScratchUse use, std::size_t count) {
  constexpr std::size_t kRow = 1024;  // a tensor's extents are int: spread the count over two
  thread_local std::array<Tensor, 7> buffers;
  Tensor& buffer = buffers[static_cast<int>(use)];
  buffer.resize({static_cast<int>((count + kRow - 1) / kRow), 1, 1, static_cast<int>(kRow)});
  return buffer.data();
}

}  // namespace sdmt::nn
