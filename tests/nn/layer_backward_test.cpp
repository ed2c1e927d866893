// SPDX-License-Identifier: Apache-2.0
// Gradients of every layer against central differences, taken in double on the definitions.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nn/every_target.h"
#include "nn/gradient_check.h"
#include "nn/oracle.h"
#include "nn/random_tensor.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"

namespace sdmt::nn {
namespace {

using oracle::Array;
/// The layer's definition as a function of its input and its parameters in order.
using Definition = std::function<Array(const Array& x, const std::vector<Array>& parameters)>;

constexpr double kTolerance = 1e-5;

/// Runs forward and backward of `layer` for L = sum of dy * y with random dy, and compares the
/// gradients of x and of every parameter with differences of `definition`.
void expect_right_gradients(Layer& layer, const Tensor& x, const Definition& definition,
                            Random& random) {
  layer.parameters_changed();
  Tensor y;
  layer.forward(x, y, Mode::training);
  const Tensor dy = random_tensor(y.shape(), random);
  Tensor dx;
  layer.backward(x, y, dy, &dx);

  Array point(x);
  std::vector<Array> parameters;
  for (const Parameter* parameter : layer.parameters()) parameters.emplace_back(parameter->value);
  const auto loss = [&] {
    const Array result = definition(point, parameters);
    double sum = 0.0;
    for (std::size_t i = 0; i < result.values.size(); ++i) sum += result.values[i] * dy.values()[i];
    return sum;
  };
  ASSERT_EQ(dx.shape(), x.shape());
  const GradientCheck input = check_gradient(point.values, loss, dx.values(), 60);
  EXPECT_LT(input.worst, kTolerance) << "input: " << input.str();
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const Parameter& parameter = *layer.parameters()[p];
    ASSERT_EQ(parameter.grad.shape(), parameter.value.shape());
    const GradientCheck check =
        check_gradient(parameters[p].values, loss, parameter.grad.values(), 60);
    EXPECT_LT(check.worst, kTolerance) << parameter.name << ": " << check.str();
  }
}

using LayerBackward = EveryTarget;
SDMT_INSTANTIATE_EVERY_TARGET(LayerBackward);

TEST_P(LayerBackward, Conv2d) {
  Random random(11);
  for (int round = 0; round < 18; ++round) {
    Conv2dOptions options{.in_channels = random_int(1, 20, random),
                          .out_channels = random_int(1, 36, random)};
    if (round % 3 == 2) {
      options.kernel_size = random_int(1, 4, random);
      options.stride = random_int(1, 2, random);
      options.padding = random_int(0, 2, random);
      options.bias = random.below(2) == 0;
    }
    const int smallest = std::max(1, options.kernel_size - 2 * options.padding);
    const Shape in{round % 4 == 0 ? 2 : 1, random_int(smallest, 9, random),
                   random_int(smallest, 9, random), options.in_channels};
    Conv2d conv(options);
    conv.reset_parameters(random);
    SCOPED_TRACE("input " + in.str() + " weight " + conv.weight().value.shape().str());
    expect_right_gradients(
        conv, random_tensor(in, random),
        [&](const Array& x, const std::vector<Array>& parameters) {
          return oracle::conv2d(x, parameters[0], options.bias ? parameters[1] : Array(),
                                options.stride, options.padding);
        },
        random);
  }
}

TEST_P(LayerBackward, Conv2dOfTheNetwork) {
  Random random(10);
  for (const auto& [in, out] : {std::pair{Shape{2, 9, 6, 3}, 64}, {Shape{1, 6, 9, 64}, 64}}) {
    Conv2d conv({.in_channels = in.c, .out_channels = out});
    conv.reset_parameters(random);
    SCOPED_TRACE("input " + in.str());
    expect_right_gradients(
        conv, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>& parameters) {
          return oracle::conv2d(x, parameters[0], parameters[1], 1, 1);
        },
        random);
  }
}

TEST_P(LayerBackward, StridedConv2dWithoutBias) {
  Random random(9);
  for (const auto& [in, out] :
       {std::pair{Shape{2, 9, 6, 3}, 32}, {Shape{1, 8, 7, 3}, 20}, {Shape{2, 7, 8, 12}, 16}}) {
    Conv2d conv({.in_channels = in.c, .out_channels = out, .stride = 2, .bias = false});
    conv.reset_parameters(random);
    SCOPED_TRACE("input " + in.str());
    ASSERT_EQ(conv.parameters().size(), 1U);
    expect_right_gradients(
        conv, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>& parameters) {
          return oracle::conv2d(x, parameters[0], Array(), 2, 1);
        },
        random);
  }
}

TEST_P(LayerBackward, Linear) {
  Random random(12);
  for (const int batch : {1, 2, 9}) {
    const Shape in{batch, 3, 1, random_int(1, 90, random)};
    class Linear linear({.in_features = 3 * in.c, .out_features = random_int(1, 45, random)});
    linear.reset_parameters(random);
    expect_right_gradients(
        linear, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>& parameters) {
          return oracle::linear(x, parameters[0], parameters[1]);
        },
        random);
  }
}

TEST(ReluBackward, PassesWhereTheResultIsPositive) {
  Random random(13);
  ReLU relu;
  expect_right_gradients(
      relu, random_tensor({2, 3, 5, 7}, random),
      [](const Array& x, const std::vector<Array>&) { return oracle::relu(x); }, random);
}

TEST(MaxPool2dBackward, GoesToTheLargestOfOddSizes) {
  Random random(14);
  for (const Shape in : {Shape{1, 2, 2, 1}, Shape{2, 5, 7, 3}, Shape{1, 4, 3, 17}}) {
    MaxPool2d pool;
    expect_right_gradients(
        pool, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>&) { return oracle::max_pool2d(x); }, random);
  }
}

TEST(MaxPool2dBackward, GoesToTheFirstOfEqualValues) {
  Tensor x({1, 2, 4, 1});  // two windows: all equal, and equal in the right column
  const float values[] = {3, 3, 1, 5, 3, 3, 2, 5};
  std::copy(std::begin(values), std::end(values), x.data());
  Tensor y;
  MaxPool2d pool;
  pool.forward(x, y, Mode::training);
  Tensor dy({1, 1, 2, 1});
  dy.fill(1.0F);
  Tensor dx;
  pool.backward(x, y, dy, &dx);
  const std::vector<float> expected = {1, 0, 0, 1, 0, 0, 0, 0};  // PyTorch's answer
  EXPECT_EQ(std::vector<float>(dx.values().begin(), dx.values().end()), expected);
}

TEST_P(LayerBackward, BatchNormSeesThroughTheStatistics) {
  Random random(15);
  for (const Shape in :
       {Shape{2, 1, 1, 3}, Shape{9, 1, 1, 5}, Shape{2, 3, 3, 4}, Shape{5, 23, 13, 9}}) {
    BatchNorm norm({.num_features = in.c, .eps = 1e-2});
    norm.weight().value = random_tensor({1, 1, 1, in.c}, random);
    norm.bias().value = random_tensor({1, 1, 1, in.c}, random);
    expect_right_gradients(
        norm, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>& parameters) {
          return oracle::batch_norm_training(x, parameters[0], parameters[1], 1e-2);
        },
        random);
  }
}

TEST_P(LayerBackward, FrozenBatchNormIsAffine) {
  Random random(17);
  for (const Shape in : {Shape{1, 1, 1, 3}, Shape{2, 3, 3, 4}, Shape{5, 23, 13, 9}}) {
    BatchNorm norm({.num_features = in.c, .eps = 1e-2});
    norm.freeze_statistics(true);
    norm.weight().value = random_tensor({1, 1, 1, in.c}, random);
    norm.bias().value = random_tensor({1, 1, 1, in.c}, random);
    norm.running_mean().value = random_tensor({1, 1, 1, in.c}, random);
    for (float& variance : norm.running_var().value.values()) {
      variance = static_cast<float>(random.uniform(0.1, 4));
    }
    const Array mean(norm.running_mean().value), variance(norm.running_var().value);
    expect_right_gradients(
        norm, random_tensor(in, random),
        [&](const Array& x, const std::vector<Array>& parameters) {
          return oracle::batch_norm_inference(x, parameters[0], parameters[1], mean, variance,
                                              1e-2);
        },
        random);
    EXPECT_EQ(Array(norm.running_mean().value).values, mean.values);
    EXPECT_EQ(Array(norm.running_var().value).values, variance.values);
  }
}

TEST_P(LayerBackward, InstanceNormSeesThroughTheStatistics) {
  Random random(16);
  for (const Shape in : {Shape{1, 1, 2, 3}, Shape{3, 3, 3, 4}, Shape{2, 23, 27, 9}}) {
    InstanceNorm norm({.num_features = in.c, .eps = 1e-2});
    norm.weight().value = random_tensor({1, 1, 1, in.c}, random);
    norm.bias().value = random_tensor({1, 1, 1, in.c}, random);
    expect_right_gradients(
        norm, random_tensor(in, random),
        [](const Array& x, const std::vector<Array>& parameters) {
          return oracle::instance_norm(x, parameters[0], parameters[1], 1e-2);
        },
        random);
  }
}

TEST(L2NormalizeBackward, RemovesThePartAlongTheRow) {
  Random random(16);
  L2Normalize normalize;
  expect_right_gradients(
      normalize, random_tensor({3, 1, 1, 17}, random),
      [](const Array& x, const std::vector<Array>&) { return oracle::l2_normalize(x, 1e-12); },
      random);
}

TEST(GradientAccumulation, AddsToWhatIsThereAndSkipsFrozenParameters) {
  Random random(17);
  Conv2d conv({.in_channels = 5, .out_channels = 7});
  conv.reset_parameters(random);
  conv.bias().trainable = false;
  const Tensor x = random_tensor({2, 6, 5, 5}, random);
  const Tensor dy = random_tensor({2, 6, 5, 7}, random);
  conv.backward(x, dy, dy, nullptr);
  const Tensor once = conv.weight().grad;
  conv.backward(x, dy, dy, nullptr);
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_NEAR(conv.weight().grad.values()[i], 2.0F * once.values()[i], 1e-4);
  }
  EXPECT_TRUE(conv.bias().grad.empty());
}

/// The checker itself: a planted error of a thousandth of the gradient must not pass.
TEST(GradientChecker, FindsAPlantedError) {
  Random random(18);
  class Linear linear({.in_features = 6, .out_features = 4});
  linear.reset_parameters(random);
  const Tensor x = random_tensor({3, 1, 1, 6}, random);
  Tensor y;
  linear.forward(x, y, Mode::training);
  Tensor dy(y.shape());
  dy.fill(1.0F);
  Tensor dx;
  linear.backward(x, y, dy, &dx);
  Array point(x);
  const auto loss = [&] {
    double sum = 0.0;
    for (const double value :
         oracle::linear(point, Array(linear.weight().value), Array(linear.bias().value)).values) {
      sum += value;
    }
    return sum;
  };
  EXPECT_LT(check_gradient(point.values, loss, dx.values()).worst, kTolerance);
  float largest = 0.0F;
  for (const float value : dx.values()) largest = std::max(largest, std::abs(value));
  dx.data()[7] += 1e-3F * largest;
  const GradientCheck planted = check_gradient(point.values, loss, dx.values());
  EXPECT_GT(planted.worst, 50 * kTolerance);
  EXPECT_EQ(planted.index, 7U);
}

}  // namespace
}  // namespace sdmt::nn
