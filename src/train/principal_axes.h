// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/tensor.h"

namespace sdmt::train {

// The rows of `vectors` [n, 1, 1, d] in the `dimensions` principal axes of their second moments,
// about the origin: no linear map to so few dimensions keeps their dot products better (Eckart and
// Young, 1936). Each row is scaled to length 1 again. In double, the same on every run and for any
// number of threads.
struct Projection {
  nn::Tensor rows;  // [n, 1, 1, dimensions]
  double kept = 1;  // share of the squared lengths that the axes hold, 0..1
};

// d = `dimensions`: the rows as they are; d < `dimensions`: followed by zeros, which changes no
// distance.
Projection project(const nn::Tensor& vectors, int dimensions);

}  // namespace sdmt::train
