// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/gemm.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// Weights of a large fully connected layer in float16, in the order in which this machine's matrix
/// kernel reads them: where a product waits for its weights to come from memory, half the bytes are
/// half the time. Holds only weights that float16 can express, such as those read from a file that
/// stores float16, so that no product changes by more than the order of its sum.
class HalfWeights {
 public:
  /// From weights [out,1,1,in]. False, and empty, when some weight is not a float16 number.
  bool set(const Tensor& weight);

  void clear() { in_ = out_ = 0; }
  bool empty() const { return in_ == 0; }
  std::int64_t in_features() const { return in_; }
  std::int64_t out_features() const { return out_; }
  const std::uint16_t* data() const;

 private:
  std::int64_t in_ = 0;
  std::int64_t out_ = 0;
  Tensor memory_;  // two numbers in a float: [stretch of in][panel of columns][in][column]
};

/// C = X W^T for X [m,in]. Each value is summed in an order that in_features alone fixes.
void multiply_rows(std::int64_t m, const float* x, const HalfWeights& weights, ProductView c);

}  // namespace sdmt::nn
