// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// Each image (a row of the batch) divided by its Euclidean norm, as
/// torch.nn.functional.normalize: y = x / max(|x|, 1e-12). A zero row stays zero.
class L2Normalize : public Layer {
 public:
  static constexpr double kEps = 1e-12;

  std::string_view type() const override { return "L2Normalize"; }
  Shape output_shape(Shape in) const override { return in; }
  void infer(const Tensor& x, Tensor& y) const override;
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;
};

}  // namespace sdmt::nn
