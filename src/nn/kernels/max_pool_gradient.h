// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::nn {

/// Gradient of y, the maxima of 2x2 windows of x: dy goes to the first largest value of each
/// window, in the order of rows, if it is above `bound`; all other values of dx become 0.
void max_pool_gradient(const Tensor& x, const Tensor& y, const Tensor& dy, float bound, Tensor& dx);

}  // namespace sdmt::nn
