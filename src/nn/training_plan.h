// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/layer.h"

namespace sdmt::nn {

class Conv2d;
class MaxPool2d;
class NormLayer;

/// How layers run one after another in training, with as few passes over memory as possible: a
/// convolution or normalisation makes the result of the ReLU after it at once, and the
/// gradient of a ReLU is taken in passing by the normalisation below it, or by the convolution or
/// pooling above it. Values are those of the separate layers.
class TrainingPlan {
 public:
  /// The layers must outlive the plan.
  explicit TrainingPlan(const std::vector<Layer*>& layers);

  /// The result is valid until the next call; x must stay as it is until backward() is done.
  const Tensor& forward(const Tensor& x);
  /// As Sequential::backward(), for the last forward().
  void backward(const Tensor& dy, Tensor* dx);

 private:
  /// A layer, and the ReLU after it if it is a convolution or normalisation; or a ReLU alone.
  struct Step {
    Layer* layer = nullptr;
    Conv2d* convolution = nullptr;  // what the layer is, if it is one of these
    NormLayer* norm = nullptr;
    MaxPool2d* pool = nullptr;
    bool relu = false;
    bool relu_taken_above = false;  // the gradient comes through the ReLU already
    bool takes_relu_below = false;  // and is handed down so
    Tensor result = {};
  };

  void run_forward(Step& step, const Tensor& x);
  void run_backward(Step& step, const Tensor& x, const Tensor& dy, Tensor* dx);
  /// The first step with a trainable parameter, or the number of steps.
  int lowest_trainable() const;
  const Tensor& input_of(int step) const { return step == 0 ? *input_ : steps_[step - 1].result; }

  std::vector<Step> steps_;
  const Tensor* input_ = nullptr;
  Tensor gradients_[2];
};

}  // namespace sdmt::nn
