// SPDX-License-Identifier: Apache-2.0
// Forward, gradients and optimiser steps against PyTorch; tests/parity/make_layers.py made the
// fixture and says what it holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "nn/every_target.h"
#include "sdmt/io/safetensors.h"
#include "sdmt/nn/adam.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/nn/sgd.h"

namespace sdmt::nn {
namespace {

std::unique_ptr<Conv2d> conv(int in, int out, int stride = 1, bool bias = true) {
  return std::make_unique<Conv2d>(
      Conv2dOptions{.in_channels = in, .out_channels = out, .stride = stride, .bias = bias});
}

std::unique_ptr<BatchNorm> norm(int channels) {
  return std::make_unique<BatchNorm>(BatchNormOptions{.num_features = channels});
}

std::unique_ptr<Linear> linear(int in, int out) {
  return std::make_unique<Linear>(LinearOptions{.in_features = in, .out_features = out});
}

/// A network, and what PyTorch made of the same one.
class FixtureNetwork : public EveryTarget {
 protected:
  FixtureNetwork(const std::string& fixture, Shape input)
      : fixture_(std::filesystem::path(SDMT_TESTS_DIR) / "nn/fixtures" / fixture),
        x_(input),
        dy_({4, 1, 1, 16}) {
    read("x", x_);
    read("dy", dy_);
  }

  void read_start() {
    for (const NamedParameter& named : net_.named_parameters()) {
      read("start." + named.name, named.parameter->value);
    }
    net_.parameters_changed();
  }

  void read(const std::string& name, Tensor& to) {
    const io::SafetensorsEntry& entry = fixture_.at(name);
    ASSERT_EQ(entry.count(), to.size()) << name;
    fixture_.read_floats(entry, to.values());
  }

  void expect_near(const std::string& name, const Tensor& actual, double tolerance) {
    Tensor expected(actual.shape());
    read(name, expected);
    double largest = 0.0;
    double worst = 0.0;
    for (std::size_t i = 0; i < actual.size(); ++i) {
      largest = std::max(largest, std::abs(static_cast<double>(expected.values()[i])));
      const double error = std::abs(actual.values()[i] - expected.values()[i]);
      worst = error <= worst ? worst : error;
    }
    EXPECT_LT(worst, tolerance * std::max(largest, 1e-6)) << name;
  }

  void expect_same_results() {
    expect_near("inference", net_.forward(x_, Mode::inference), 1e-5);
    expect_near("training", net_.forward(x_, Mode::training), 1e-5);
    net_.parameters_changed();
    expect_near("inference after training", net_.forward(x_, Mode::inference), 1e-5);
  }

  void expect_same_gradients() {
    net_.forward(x_, Mode::training);
    Tensor dx;
    net_.backward(dy_, &dx);
    expect_near("dx", dx, 2e-5);
    for (const NamedParameter& named : net_.named_parameters()) {
      if (is_rounding(named.name)) continue;
      expect_near("gradient." + named.name, named.parameter->grad, 2e-5);
    }
  }

  /// The batch normalisation takes away what a bias before it adds: the gradient of such a bias is
  /// rounding.
  static bool is_rounding(const std::string& name) {
    return name == "fc.bias" || name == "conv3.bias";
  }

  void expect_same_steps(const std::string& kind, Optimizer& optimizer) {
    // As in the fixture, weight decay acts on everything.
    for (const NamedParameter& named : net_.named_parameters()) named.parameter->decay = true;
    for (int step = 0; step < 5; ++step) {
      optimizer.zero_grad();
      net_.forward(x_, Mode::training);
      net_.backward(dy_);
      optimizer.step();
      net_.parameters_changed();
    }
    for (const NamedParameter& named : net_.named_parameters()) {
      if (is_rounding(named.name)) continue;
      expect_near(kind + "." + named.name, named.parameter->value, 1e-4);
    }
    for (const NamedTensor& named : net_.named_buffers()) {
      expect_near(kind + "." + named.name, *named.tensor, 1e-4);
    }
  }

  void expect_same_sgd_steps() {
    Sgd sgd(net_.named_parameters(),
            {.learning_rate = 0.05, .momentum = 0.9, .weight_decay = 0.01});
    expect_same_steps("sgd", sgd);
  }

  void expect_same_adam_steps() {
    Adam adam(
        net_.named_parameters(),
        {.learning_rate = 0.01, .beta1 = 0.9, .beta2 = 0.99, .eps = 1e-2, .weight_decay = 0.01});
    expect_same_steps("adam", adam);
  }

  io::Safetensors fixture_;
  Sequential net_;
  Tensor x_;
  Tensor dy_;
};

class LayerParity : public FixtureNetwork {
 protected:
  LayerParity() : FixtureNetwork("layers.safetensors", {4, 10, 7, 3}) {
    net_.add("conv1", conv(3, 32))
        .add("relu1", std::make_unique<ReLU>())
        .add("conv2", conv(32, 20))
        .add("relu2", std::make_unique<ReLU>())
        .add("pool", std::make_unique<MaxPool2d>())
        .add("conv3", conv(20, 12))
        .add("relu3", std::make_unique<ReLU>())
        .add("fc", linear(12 * 5 * 3, 16))
        .add("bn", norm(16))
        .add("l2", std::make_unique<L2Normalize>());
    read_start();
  }
};

class NormalizedLayerParity : public FixtureNetwork {
 protected:
  NormalizedLayerParity() : FixtureNetwork("normalized_layers.safetensors", {4, 21, 14, 3}) {
    net_.add("conv1", conv(3, 32, 2, false))
        .add("bn1", norm(32))
        .add("relu1", std::make_unique<ReLU>())
        .add("conv2", conv(32, 20, 1, false))
        .add("in2", std::make_unique<InstanceNorm>(InstanceNormOptions{.num_features = 20}))
        .add("relu2", std::make_unique<ReLU>())
        .add("pool", std::make_unique<MaxPool2d>())
        .add("conv3", conv(20, 12, 2))
        .add("bn3", norm(12))
        .add("relu3", std::make_unique<ReLU>())
        .add("fc", linear(12 * 3 * 2, 16))
        .add("bn", norm(16))
        .add("l2", std::make_unique<L2Normalize>());
    read_start();
  }
};

SDMT_INSTANTIATE_EVERY_TARGET(LayerParity);
SDMT_INSTANTIATE_EVERY_TARGET(NormalizedLayerParity);

TEST_P(LayerParity, ForwardAgreesInBothModes) { expect_same_results(); }
TEST_P(LayerParity, GradientsAgreeByName) { expect_same_gradients(); }
TEST_P(LayerParity, SgdStepsAgree) { expect_same_sgd_steps(); }
TEST_P(LayerParity, AdamStepsAgree) { expect_same_adam_steps(); }

TEST_P(NormalizedLayerParity, ForwardAgreesInBothModes) { expect_same_results(); }
TEST_P(NormalizedLayerParity, GradientsAgreeByName) { expect_same_gradients(); }
TEST_P(NormalizedLayerParity, SgdStepsAgree) { expect_same_sgd_steps(); }
TEST_P(NormalizedLayerParity, AdamStepsAgree) { expect_same_adam_steps(); }

}  // namespace
}  // namespace sdmt::nn
