// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/sequential.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nn/random_tensor.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {
namespace {

/// A small network with all kinds of layers, for [n,10,6,3].
void build(Sequential& net, std::uint64_t seed) {
  Random random(seed);
  const auto conv = [&](int in, int out) {
    auto layer = std::make_unique<Conv2d>(Conv2dOptions{.in_channels = in, .out_channels = out});
    layer->reset_parameters(random);
    return layer;
  };
  auto fc = std::make_unique<Linear>(LinearOptions{.in_features = 5 * 3 * 24, .out_features = 9});
  fc->reset_parameters(random);
  net.add("conv1", conv(3, 20))
      .add("relu1", std::make_unique<ReLU>())
      .add("conv2", conv(20, 24))
      .add("relu2", std::make_unique<ReLU>())
      .add("pool", std::make_unique<MaxPool2d>())
      .add("conv3", conv(24, 24))
      .add("fc", std::move(fc))
      .add("bn", std::make_unique<BatchNorm>(BatchNormOptions{.num_features = 9}))
      .add("l2", std::make_unique<L2Normalize>());
}

/// Each convolution normalised, for [n,17,13,3]; what is folded or fused, and a layer between that
/// is neither.
void build_normalized(Sequential& net, std::uint64_t seed) {
  Random random(seed);
  const auto conv = [&](int in, int out, int stride, bool bias) {
    auto layer = std::make_unique<Conv2d>(
        Conv2dOptions{.in_channels = in, .out_channels = out, .stride = stride, .bias = bias});
    layer->reset_parameters(random);
    return layer;
  };
  const auto norm = [&](int channels) {
    auto layer = std::make_unique<BatchNorm>(BatchNormOptions{.num_features = channels});
    for (Tensor* tensor : {&layer->weight().value, &layer->bias().value,
                           &layer->running_mean().value, &layer->running_var().value}) {
      for (float& value : tensor->values()) value = static_cast<float>(random.uniform(0.2, 1.2));
    }
    return layer;
  };
  auto fc = std::make_unique<Linear>(LinearOptions{.in_features = 2 * 1 * 16, .out_features = 9});
  fc->reset_parameters(random);
  net.add("conv1", conv(3, 16, 2, false))
      .add("bn1", norm(16))
      .add("relu1", std::make_unique<ReLU>())
      .add("conv2", conv(16, 24, 1, true))
      .add("bn2", norm(24))
      .add("relu2", std::make_unique<ReLU>())
      .add("pool2", std::make_unique<MaxPool2d>())
      .add("conv3", conv(24, 16, 1, false))
      .add("bn3", norm(16))
      .add("pool3", std::make_unique<MaxPool2d>())
      .add("relu3", std::make_unique<ReLU>())
      .add("bn4", norm(16))
      .add("relu4", std::make_unique<ReLU>())
      .add("fc", std::move(fc))
      .add("relu5", std::make_unique<ReLU>())
      .add("bn5", norm(9))
      .add("relu6", std::make_unique<ReLU>());
}

std::vector<float> copy(const Tensor& tensor) {
  return {tensor.values().begin(), tensor.values().end()};
}

/// Layer after layer without Sequential.
struct ByHand {
  std::vector<Tensor> results;
  ByHand(Sequential& net, const Tensor& x, Mode mode) {
    results.resize(static_cast<std::size_t>(net.size()));
    const Tensor* from = &x;
    for (int i = 0; i < net.size(); ++i) {
      Tensor& to = results[static_cast<std::size_t>(i)];
      net.layer(i).forward(*from, to, mode);
      from = &to;
    }
  }
};

TEST(Sequential, FusedInferenceEqualsTheLayersOneByOne) {
  Sequential net;
  build(net, 1);
  Random random(2);
  const Tensor x = random_tensor({3, 10, 6, 3}, random);
  const ByHand expected(net, x, Mode::inference);
  EXPECT_EQ(copy(net.forward(x, Mode::inference)), copy(expected.results.back()));
  EXPECT_EQ(net.output_shape(x.shape()), (Shape{3, 1, 1, 9}));
}

TEST(Sequential, EverySubRangeEqualsTheLayersOneByOne) {
  Sequential net;
  build(net, 1);
  Random random(3);
  const Tensor x = random_tensor({2, 10, 6, 3}, random);
  for (const Mode mode : {Mode::inference, Mode::training}) {
    const ByHand expected(net, x, mode);
    for (int first = 0; first < net.size(); ++first) {
      const Tensor& from = first == 0 ? x : expected.results[static_cast<std::size_t>(first - 1)];
      for (int last = first + 1; last <= net.size(); ++last) {
        EXPECT_EQ(copy(net.forward(from, mode, first, last)),
                  copy(expected.results[static_cast<std::size_t>(last - 1)]))
            << first << ".." << last;
      }
    }
    EXPECT_EQ(&net.forward(x, mode, 4, 4), &x);
  }
}

TEST(Sequential, ALargeBatchPassesInGroupsWithTheSameValues) {
  Random random(9);
  Sequential net;
  net.add("conv1", std::make_unique<Conv2d>(Conv2dOptions{.in_channels = 3, .out_channels = 64}))
      .add("relu1", std::make_unique<ReLU>())
      .add("conv2", std::make_unique<Conv2d>(Conv2dOptions{.in_channels = 64, .out_channels = 16}))
      .add("relu2", std::make_unique<ReLU>())
      .add("pool", std::make_unique<MaxPool2d>())
      .add("l2", std::make_unique<L2Normalize>());
  for (const int i : {0, 2}) dynamic_cast<Conv2d&>(net.layer(i)).reset_parameters(random);
  const Tensor x = random_tensor({7, 130, 122, 3}, random);  // too large for one group
  const std::vector<float> all = copy(net.forward(x, Mode::inference));
  EXPECT_EQ(all, copy(ByHand(net, x, Mode::inference).results.back()));
  for (int n = 0; n < 7; ++n) {
    const std::vector<float> alone = copy(net.forward(x.images(n, 1), Mode::inference));
    ASSERT_TRUE(std::equal(alone.begin(), alone.end(),
                           all.begin() + static_cast<std::ptrdiff_t>(n * alone.size())))
        << n;
  }
}

TEST(Sequential, BackwardEqualsTheLayersOneByOne) {
  Random random(4);
  const Tensor x = random_tensor({2, 10, 6, 3}, random);
  const Tensor dy = random_tensor({2, 1, 1, 9}, random);

  Sequential by_hand;
  build(by_hand, 1);
  const ByHand values(by_hand, x, Mode::training);
  Tensor gradient = dy;
  for (int i = by_hand.size() - 1; i >= 0; --i) {
    const auto at = static_cast<std::size_t>(i);
    Tensor below;
    by_hand.layer(i).backward(i == 0 ? x : values.results[at - 1], values.results[at], gradient,
                              &below);
    gradient = below;
  }

  Sequential net;
  build(net, 1);
  net.forward(x, Mode::training);
  Tensor dx;
  net.backward(dy, &dx);
  EXPECT_EQ(copy(dx), copy(gradient));
  const auto expected = by_hand.named_parameters();
  const auto actual = net.named_parameters();
  ASSERT_EQ(actual.size(), 10U);
  for (std::size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(actual[i].name, expected[i].name);
    EXPECT_EQ(copy(actual[i].parameter->grad), copy(expected[i].parameter->grad)) << actual[i].name;
  }

  // From the middle: the same gradients above, nothing below.
  Sequential upper;
  build(upper, 1);
  upper.forward(values.results[4], Mode::training, 5);
  upper.backward(dy);
  for (std::size_t i = 0; i < actual.size(); ++i) {
    const Tensor& grad = upper.named_parameters()[i].parameter->grad;
    if (i < 4) {
      EXPECT_TRUE(grad.empty());
    } else {
      EXPECT_EQ(copy(grad), copy(actual[i].parameter->grad)) << actual[i].name;
    }
  }
}

/// Layer after layer backward: the gradient of x, and in `net` those of the parameters.
Tensor backward_by_hand(Sequential& net, const ByHand& values, const Tensor& x, const Tensor& dy) {
  Tensor gradient = dy;
  for (int i = net.size() - 1; i >= 0; --i) {
    Tensor dx;
    net.layer(i).backward(i == 0 ? x : values.results[static_cast<std::size_t>(i - 1)],
                          values.results[static_cast<std::size_t>(i)], gradient, &dx);
    gradient = dx;
  }
  return gradient;
}

TEST(Sequential, ANormalizedChainTrainsAsTheLayersOneByOne) {
  Random random(12);
  const Tensor x = random_tensor({3, 17, 13, 3}, random);
  const Tensor dy = random_tensor({3, 1, 1, 9}, random);
  Sequential by_hand;
  build_normalized(by_hand, 1);
  const ByHand values(by_hand, x, Mode::training);
  const Tensor expected_dx = backward_by_hand(by_hand, values, x, dy);
  Sequential net;
  build_normalized(net, 1);
  EXPECT_EQ(copy(net.forward(x, Mode::training)), copy(values.results.back()));
  Tensor dx;
  net.backward(dy, &dx);
  EXPECT_EQ(copy(dx), copy(expected_dx));
  const auto actual = net.named_parameters();
  const auto expected = by_hand.named_parameters();
  for (std::size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(copy(actual[i].parameter->grad), copy(expected[i].parameter->grad)) << actual[i].name;
  }
  for (std::size_t i = 0; i < net.named_buffers().size(); ++i) {
    EXPECT_EQ(copy(*net.named_buffers()[i].tensor), copy(*by_hand.named_buffers()[i].tensor));
  }
}

/// Folded weights are rounded, and the tiles of inference round more (see layer_forward_test.cpp).
void expect_close(const std::vector<float>& actual, const std::vector<float>& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  float largest = 0.0F;
  for (const float value : expected) largest = std::max(largest, std::abs(value));
  for (std::size_t i = 0; i < actual.size(); ++i) {
    ASSERT_NEAR(actual[i], expected[i], 2e-4F * largest) << i;
  }
}

TEST(Sequential, FoldedNormalizationFollowsTheParameters) {
  Random random(13);
  const Tensor x = random_tensor({3, 17, 13, 3}, random);
  Sequential net;
  build_normalized(net, 1);
  for (int first = 0; first < net.size(); ++first) {
    const ByHand values(net, x, Mode::inference);
    const Tensor& from = first == 0 ? x : values.results[static_cast<std::size_t>(first - 1)];
    for (int last = first + 1; last <= net.size(); ++last) {
      SCOPED_TRACE(std::to_string(first) + ".." + std::to_string(last));
      expect_close(copy(net.forward(from, Mode::inference, first, last)),
                   copy(values.results[static_cast<std::size_t>(last - 1)]));
    }
    if (first % 6 != 0) continue;
    // Other statistics and weights for the next ranges, and for all plans that exist.
    net.forward(x, Mode::training);
    for (const NamedParameter& named : net.named_parameters()) {
      for (float& value : named.parameter->value.values()) value *= 1.1F;
    }
    net.parameters_changed();
    expect_close(copy(net.forward(x, Mode::inference)),
                 copy(ByHand(net, x, Mode::inference).results.back()));
  }
}

TEST(Sequential, ReleasedItInfersTheSameAtAnySizeOfMapAndDoesNotTrain) {
  Random random(14);
  Sequential net, released;
  build_normalized(net, 1);
  build_normalized(released, 1);
  released.release_for_inference();
  const Tensor x = random_tensor({3, 17, 13, 3}, random);
  EXPECT_EQ(copy(released.forward(x, Mode::inference)), copy(net.forward(x, Mode::inference)));
  // Another tile, which the folded weights have yet to be transformed for.
  Sequential convolutions, released_convolutions;
  for (Sequential* one : {&convolutions, &released_convolutions}) {
    auto conv = std::make_unique<Conv2d>(Conv2dOptions{.in_channels = 8, .out_channels = 16});
    Random weights(3);
    conv->reset_parameters(weights);
    one->add("conv", std::move(conv))
        .add("bn", std::make_unique<BatchNorm>(BatchNormOptions{.num_features = 16}));
  }
  released_convolutions.release_for_inference();
  EXPECT_TRUE(released_convolutions.named_parameters().front().parameter->value.empty());
  for (const Shape shape : {Shape{1, 64, 32, 8}, Shape{1, 8, 4, 8}}) {
    const Tensor map = random_tensor(shape, random);
    EXPECT_EQ(copy(released_convolutions.forward(map, Mode::inference)),
              copy(convolutions.forward(map, Mode::inference)));
  }
  EXPECT_THROW(released.forward(x, Mode::training), std::logic_error);
}

TEST(Sequential, BackwardStopsBelowTheLowestTrainableLayer) {
  Random random(5);
  const Tensor x = random_tensor({2, 10, 6, 3}, random);
  const Tensor dy = random_tensor({2, 1, 1, 9}, random);
  Sequential net;
  build(net, 1);
  for (const int frozen : {net.index("conv1"), net.index("conv2")}) {
    for (Parameter* parameter : net.layer(frozen).parameters()) parameter->trainable = false;
  }
  net.forward(x, Mode::training);
  net.backward(dy);
  EXPECT_TRUE(net.layer(0).parameters()[0]->grad.empty());
  EXPECT_FALSE(net.layer(net.index("conv3")).parameters()[0]->grad.empty());
}

TEST(Sequential, OneAndTwoThreadsGiveTheSameBytes) {
  Random random(6);
  const Tensor x = random_tensor({5, 10, 6, 3}, random);
  const Tensor dy = random_tensor({5, 1, 1, 9}, random);
  const int threads = omp_get_max_threads();
  std::vector<std::vector<float>> runs[3];
  for (int count = 1; count <= 3; ++count) {
    omp_set_num_threads(count);
    Sequential net;
    build(net, 1);
    auto& run = runs[count - 1];
    run.push_back(copy(net.forward(x, Mode::inference)));
    run.push_back(copy(net.forward(x, Mode::training)));
    Tensor dx;
    net.backward(dy, &dx);
    run.push_back(copy(dx));
    for (const NamedParameter& named : net.named_parameters()) {
      run.push_back(copy(named.parameter->grad));
    }
  }
  omp_set_num_threads(threads);
  EXPECT_EQ(runs[0], runs[1]);
  EXPECT_EQ(runs[0], runs[2]);
}

TEST(Sequential, RefusesWrongUse) {
  Sequential net;
  build(net, 1);
  EXPECT_THROW(net.add("conv1", std::make_unique<ReLU>()), std::invalid_argument);
  EXPECT_THROW(net.add("", std::make_unique<ReLU>()), std::invalid_argument);
  EXPECT_THROW(net.index("conv9"), std::invalid_argument);
  const Tensor x({2, 10, 6, 3});
  EXPECT_THROW(net.forward(x, Mode::inference, 3, 2), std::invalid_argument);
  EXPECT_THROW(net.forward(x, Mode::inference, 0, 99), std::invalid_argument);
  EXPECT_THROW(net.backward(Tensor({2, 1, 1, 9})), std::logic_error);
  net.forward(x, Mode::training);
  EXPECT_THROW(net.backward(Tensor({3, 1, 1, 9})), std::invalid_argument);
  net.backward(Tensor({2, 1, 1, 9}));
  EXPECT_THROW(net.backward(Tensor({2, 1, 1, 9})), std::logic_error);
}

}  // namespace
}  // namespace sdmt::nn
