// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::nn {

/// A small network for crops of 128 x 64, 0.21 GFLOP: eight 3x3 convolutions, each normalised and
/// rectified, of 32 to 256 channels on maps of 64x32 to 8x4, then two fully connected layers.
inline void build_lite(Sequential& net) {
  Random random(3);
  int channels = 3;
  const auto convolution = [&](const std::string& name, int out, int stride = 1) {
    auto conv = std::make_unique<Conv2d>(Conv2dOptions{
        .in_channels = channels, .out_channels = out, .stride = stride, .bias = false});
    conv->reset_parameters(random);
    net.add("conv" + name, std::move(conv))
        .add("bn" + name, std::make_unique<BatchNorm>(BatchNormOptions{.num_features = out}))
        .add("relu" + name, std::make_unique<ReLU>());
    channels = out;
  };
  const auto linear = [&](const std::string& name, int in) {
    auto fc = std::make_unique<Linear>(LinearOptions{.in_features = in, .out_features = 128});
    fc->reset_parameters(random);
    net.add(name, std::move(fc));
  };
  for (int stage = 1; stage <= 4; ++stage) {
    const std::string number = std::to_string(stage);
    convolution(number + "_1", 16 << stage, stage == 1 ? 2 : 1);
    convolution(number + "_2", 16 << stage);
    if (stage < 4) net.add("pool" + number, std::make_unique<MaxPool2d>());
  }
  linear("fc1", 8 * 4 * 256);
  net.add("relu_fc1", std::make_unique<ReLU>());
  linear("fc2", 128);
  net.add("bn", std::make_unique<BatchNorm>(BatchNormOptions{.num_features = 128}))
      .add("l2", std::make_unique<L2Normalize>());
}

}  // namespace sdmt::nn
