// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/norm_layer.h"

#include <string>
#include <utility>

namespace sdmt::nn {

namespace {

/// [1,1,1,channels], all `start`; without weight decay.
Parameter channel_parameter(std::string name, int channels, float start) {
  Parameter parameter;
  parameter.name = std::move(name);
  parameter.value = Tensor({1, 1, 1, channels});
  parameter.decay = false;
  parameter.value.fill(start);
  return parameter;
}

}  // namespace

NormLayer::NormLayer(int num_features, float initial_gamma, float initial_beta)
    : weight_(channel_parameter("weight", num_features, initial_gamma)),
      bias_(channel_parameter("bias", num_features, initial_beta)) {}

void NormLayer::forward(const Tensor& x, Tensor& y, Mode mode) {
  if (mode == Mode::inference) return infer(x, y);
  train(x, y, false);
}

void NormLayer::backward(const Tensor& x, const Tensor&, const Tensor& dy, Tensor* dx) {
  gradients(x, dy, dx, false);
}

}  // namespace sdmt::nn
