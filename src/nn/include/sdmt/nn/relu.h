// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// y = max(x, 0) for any shape. The gradient at 0 is 0, as in PyTorch; NaN stays NaN.
class ReLU : public Layer {
 public:
  std::string_view type() const override { return "ReLU"; }
  Shape output_shape(Shape in) const override { return in; }
  void infer(const Tensor& x, Tensor& y) const override;
  /// Does not read x: y tells which values passed. dx and dy may be the same tensor.
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;
};

}  // namespace sdmt::nn
