// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// What happens to the result of a convolution before it is stored, in this order.
struct ConvolutionEpilogue {
  const float* bias = nullptr;  ///< out_channels values
  bool relu = false;
  bool max_pool = false;         ///< 2x2, stride 2, an odd last row or column dropped
  const Tensor* mask = nullptr;  ///< of the result's shape: results where it is not > 0 become 0
};

}  // namespace sdmt::nn
