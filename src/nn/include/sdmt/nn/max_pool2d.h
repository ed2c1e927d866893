// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

/// Maximum over 2x2 windows with stride 2, as torch.nn.MaxPool2d(2): [n,h,w,c] -> [n,h/2,w/2,c]; an
/// odd last row or column is dropped. Throws std::invalid_argument when h or w is below 2.
/// The gradient goes to the first largest value of a window in the order of rows.
class MaxPool2d : public Layer {
 public:
  std::string_view type() const override { return "MaxPool2d"; }
  Shape output_shape(Shape in) const override;
  void infer(const Tensor& x, Tensor& y) const override;
  void backward(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor* dx) override;

 private:
  friend class TrainingPlan;  // runs it together with a ReLU below it
  /// backward() through this layer and a ReLU below it, whose result x is: dx is the gradient
  /// before that ReLU.
  void backward_through_relu(const Tensor& x, const Tensor& y, const Tensor& dy, Tensor& dx);
};

}  // namespace sdmt::nn
