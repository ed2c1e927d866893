// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "sdmt/nn/tensor.h"

/// The layers once more, in double precision and as slowly and plainly as their definitions: what
/// the engine is compared with. Nothing here is shared with the engine except the shape.
namespace sdmt::nn::oracle {

struct Array {
  Shape shape;
  std::vector<double> values;

  explicit Array(Shape s = {}) : shape(s), values(s.size(), 0.0) {}
  explicit Array(const Tensor& t)
      : shape(t.shape()), values(t.values().begin(), t.values().end()) {}

  double& at(int n, int y, int x, int c) { return values[offset(n, y, x, c)]; }
  double at(int n, int y, int x, int c) const { return values[offset(n, y, x, c)]; }

 private:
  std::size_t offset(int n, int y, int x, int c) const {
    return ((static_cast<std::size_t>(n) * shape.h + y) * shape.w + x) * shape.c + c;
  }
};

/// Seven loops. weight is OHWI; bias may be empty.
Array conv2d(const Array& x, const Array& weight, const Array& bias, int stride, int padding);
/// weight is [out,1,1,in]; bias may be empty.
Array linear(const Array& x, const Array& weight, const Array& bias);
Array relu(const Array& x);
Array max_pool2d(const Array& x);
/// With the statistics of x itself.
Array batch_norm_training(const Array& x, const Array& weight, const Array& bias, double eps);
Array batch_norm_inference(const Array& x, const Array& weight, const Array& bias,
                           const Array& mean, const Array& var, double eps);
Array instance_norm(const Array& x, const Array& weight, const Array& bias, double eps);
Array l2_normalize(const Array& x, double eps);

}  // namespace sdmt::nn::oracle
