// SPDX-License-Identifier: Apache-2.0
// Every layer against its definition in double, on random shapes, for every instruction set.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nn/every_target.h"
#include "nn/oracle.h"
#include "nn/random_tensor.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::nn {
namespace {

using oracle::Array;

/// Largest difference as a fraction of the largest expected value.
double relative_error(const Tensor& actual, const Array& expected) {
  EXPECT_EQ(actual.shape(), expected.shape);
  double largest = 1e-30;
  double worst = 0.0;
  for (std::size_t i = 0; i < expected.values.size(); ++i) {
    largest = std::max(largest, std::abs(expected.values[i]));
    const double error = std::abs(actual.values()[i] - expected.values[i]);
    worst = error <= worst ? worst : error;
  }
  return worst / largest;
}

/// What rounding may make of a convolution, as a fraction of the largest output: training takes
/// Winograd's 4x4 tiles, inference 8x8 where they save multiplications (kernels/winograd.h). Here
/// the outputs are few, so that the largest is small.
constexpr double kSmallTiles = 4e-6;
constexpr double kLargeTiles = 2e-4;

using LayerForward = EveryTarget;
SDMT_INSTANTIATE_EVERY_TARGET(LayerForward);

TEST_P(LayerForward, Conv2dEqualsSevenLoops) {
  Random random(1);
  for (int round = 0; round < 45; ++round) {
    // Mostly the 3x3 convolutions of the network, on shapes that fit no block size.
    Conv2dOptions options{.in_channels = random_int(1, 40, random),
                          .out_channels = random_int(1, 70, random)};
    if (round % 3 == 2) {
      options.kernel_size = random_int(1, 5, random);
      options.stride = random_int(1, 3, random);
      options.padding = random_int(0, 2, random);
      options.bias = random.below(2) == 0;
    }
    const int smallest = std::max(1, options.kernel_size - 2 * options.padding);
    const Shape in{random_int(1, 3, random), random_int(smallest, 17, random),
                   random_int(smallest, 17, random), options.in_channels};
    auto layer = std::make_unique<Conv2d>(options);
    Conv2d& conv = *layer;
    conv.weight().value = random_tensor(conv.weight().value.shape(), random);
    if (options.bias) conv.bias().value = random_tensor(conv.bias().value.shape(), random);
    conv.parameters_changed();
    const Tensor x = random_tensor(in, random);
    const Array expected =
        oracle::conv2d(Array(x), Array(conv.weight().value), Array(conv.bias().value),
                       options.stride, options.padding);
    SCOPED_TRACE("input " + in.str() + " weight " + conv.weight().value.shape().str() + " stride " +
                 std::to_string(options.stride) + " padding " + std::to_string(options.padding));
    Tensor y;
    for (const Mode mode : {Mode::inference, Mode::training}) {
      conv.forward(x, y, mode);
      EXPECT_LT(relative_error(y, expected), mode == Mode::training ? kSmallTiles : kLargeTiles);
    }
    // What follows a convolution runs together with it in a sequence.
    Sequential net;
    net.add("conv", std::move(layer)).add("relu", std::make_unique<ReLU>());
    EXPECT_LT(relative_error(net.forward(x, Mode::inference), oracle::relu(expected)), kLargeTiles);
    if (expected.shape.h < 2 || expected.shape.w < 2) continue;
    net.add("pool", std::make_unique<MaxPool2d>());
    EXPECT_LT(
        relative_error(net.forward(x, Mode::inference), oracle::max_pool2d(oracle::relu(expected))),
        kLargeTiles);
  }
}

TEST_P(LayerForward, Conv2dOfTheNetworkEqualsSevenLoops) {
  Random random(2);
  for (const auto& [in, out] : {std::pair{Shape{1, 12, 8, 3}, 64},
                                {Shape{2, 9, 6, 64}, 64},
                                {Shape{1, 16, 8, 64}, 128},
                                {Shape{1, 8, 5, 128}, 256},
                                {Shape{1, 6, 7, 256}, 256}}) {
    Conv2d conv({.in_channels = in.c, .out_channels = out});
    conv.reset_parameters(random);
    const Tensor x = random_tensor(in, random);
    const Array expected =
        oracle::conv2d(Array(x), Array(conv.weight().value), Array(conv.bias().value), 1, 1);
    Tensor y;
    conv.forward(x, y, Mode::inference);
    EXPECT_LT(relative_error(y, expected), kLargeTiles) << in.str();
    conv.forward(x, y, Mode::training);
    EXPECT_LT(relative_error(y, expected), kSmallTiles) << in.str();
  }
}

TEST_P(LayerForward, Conv2dDoesNotDependOnThreadsOrBatch) {
  Random random(8);
  Conv2d conv({.in_channels = 112, .out_channels = 130});
  conv.reset_parameters(random);
  const Tensor x = random_tensor({3, 16, 21, 112}, random);
  const int threads = omp_get_max_threads();
  Tensor results[3];
  for (int count = 1; count <= 3; ++count) {
    omp_set_num_threads(count);
    conv.forward(x, results[count - 1], Mode::inference);
  }
  Tensor alone;  // so few tiles that the threads share the channels
  conv.forward(x.images(2, 1), alone, Mode::inference);
  omp_set_num_threads(threads);
  EXPECT_TRUE(std::ranges::equal(results[1].values(), results[0].values()));
  EXPECT_TRUE(std::ranges::equal(results[2].values(), results[0].values()));
  EXPECT_TRUE(std::equal(alone.values().begin(), alone.values().end(), results[0].image(2)));
}

TEST_P(LayerForward, LinearEqualsItsDefinition) {
  Random random(3);
  for (int round = 0; round < 30; ++round) {
    const Shape in{random_int(1, 20, random), random_int(1, 9, random), random_int(1, 9, random),
                   random_int(1, 60, random)};
    Linear linear({.in_features = static_cast<int>(in.image_size()),
                   .out_features = random_int(1, 140, random),
                   .bias = round % 4 != 0});
    linear.weight().value = random_tensor(linear.weight().value.shape(), random);
    linear.bias().value = random_tensor(linear.bias().value.shape(), random);
    const Tensor x = random_tensor(in, random);
    Tensor y;
    linear.forward(x, y, Mode::inference);
    EXPECT_LT(relative_error(y, oracle::linear(Array(x), Array(linear.weight().value),
                                               Array(linear.bias().value))),
              2e-6)
        << in.str();
  }
}

/// Rounds to 8 bits, which float16 holds.
void round_coarsely(Tensor& tensor) {
  for (float& value : tensor.values()) value = std::round(value * 4096.0F) / 4096.0F;
}

TEST_P(LayerForward, LinearWithFloat16Weights) {
  Random random(7);
  for (const int batch : {1, 2, 15, 33}) {
    Linear linear({.in_features = 9 * 701, .out_features = 67});
    linear.reset_parameters(random);
    round_coarsely(linear.weight().value);
    linear.parameters_changed();
    const Tensor x = random_tensor({batch, 9, 1, 701}, random);
    const auto expect_right = [&] {
      Tensor y;
      linear.forward(x, y, Mode::inference);
      EXPECT_LT(relative_error(y, oracle::linear(Array(x), Array(linear.weight().value),
                                                 Array(linear.bias().value))),
                4e-6)
          << batch;
    };
    expect_right();
    Linear released({.in_features = 9 * 701, .out_features = 67});
    released.weight().value = linear.weight().value;
    released.release_weights();
    EXPECT_TRUE(released.weight().value.empty());
    Tensor kept;
    Tensor y;
    linear.forward(x, kept, Mode::inference);
    released.forward(x, y, Mode::inference);
    EXPECT_TRUE(std::ranges::equal(y.values(), kept.values()));
    EXPECT_THROW(released.forward(x, y, Mode::training), std::logic_error);
    EXPECT_THROW(released.backward(x, y, kept, nullptr), std::logic_error);
    // A weight that float16 cannot hold, and would lose whole.
    linear.weight().value.values()[5] = 1e5F;
    linear.parameters_changed();
    expect_right();
    linear.release_weights();
    EXPECT_FALSE(linear.weight().value.empty());
  }
}

TEST_P(LayerForward, LinearRowsDoNotDependOnTheBatch) {
  Random random(4);
  for (const bool coarse : {false, true}) {
    Linear linear({.in_features = 3 * 5 * 700, .out_features = 67});
    linear.reset_parameters(random);
    if (coarse) round_coarsely(linear.weight().value);
    const Tensor x = random_tensor({19, 3, 5, 700}, random);
    Tensor all;
    linear.forward(x, all, Mode::inference);
    for (int n = 0; n < x.shape().n; ++n) {
      Tensor row({1, 3, 5, 700});
      std::copy_n(x.image(n), row.size(), row.data());
      Tensor alone;
      linear.forward(row, alone, Mode::inference);
      EXPECT_TRUE(std::equal(alone.values().begin(), alone.values().end(), all.image(n))) << n;
    }
  }
}

TEST(ReluAndMaxPool, AreExact) {
  Random random(5);
  for (int round = 0; round < 20; ++round) {
    const Tensor x = random_tensor({random_int(1, 3, random), random_int(2, 11, random),
                                    random_int(2, 11, random), random_int(1, 40, random)},
                                   random);
    Tensor y;
    ReLU().forward(x, y, Mode::inference);
    EXPECT_EQ(relative_error(y, oracle::relu(Array(x))), 0.0);
    MaxPool2d().forward(x, y, Mode::inference);
    EXPECT_EQ(relative_error(y, oracle::max_pool2d(Array(x))), 0.0);
  }
}

TEST(Relu, KeepsNaN) {
  Tensor x({1, 1, 1, 2});
  x.fill(std::numeric_limits<float>::quiet_NaN());
  Tensor y;
  ReLU().forward(x, y, Mode::inference);
  EXPECT_TRUE(std::isnan(y.values()[0]));
}

TEST_P(LayerForward, BatchNormMovesTheRunningStatistics) {
  Random random(6);
  for (const Shape in :
       {Shape{2, 1, 1, 1}, Shape{7, 1, 1, 13}, Shape{3, 5, 2, 4}, Shape{5, 21, 19, 11}}) {
    BatchNorm norm({.num_features = in.c, .momentum = 0.3});
    norm.weight().value = random_tensor({1, 1, 1, in.c}, random);
    norm.bias().value = random_tensor({1, 1, 1, in.c}, random);
    const Tensor x = random_tensor(in, random);
    Tensor y;
    norm.forward(x, y, Mode::training);
    const Array weight(norm.weight().value);
    const Array bias(norm.bias().value);
    EXPECT_LT(relative_error(y, oracle::batch_norm_training(Array(x), weight, bias, 1e-5)), 1e-6);
    for (int c = 0; c < in.c; ++c) {
      const double rows = in.n * in.h * in.w;
      double mean = 0.0;
      double var = 0.0;
      for (int i = 0; i < rows; ++i)
        mean += x.values()[static_cast<std::size_t>(i * in.c + c)] / rows;
      for (int i = 0; i < rows; ++i) {
        var += std::pow(x.values()[static_cast<std::size_t>(i * in.c + c)] - mean, 2) / (rows - 1);
      }
      EXPECT_NEAR(norm.running_mean().value.data()[c], 0.3 * mean, 1e-6);
      EXPECT_NEAR(norm.running_var().value.data()[c], 0.7 + 0.3 * var, 1e-5);
    }
    norm.forward(x, y, Mode::inference);
    EXPECT_LT(relative_error(y, oracle::batch_norm_inference(
                                    Array(x), weight, bias, Array(norm.running_mean().value),
                                    Array(norm.running_var().value), 1e-5)),
              1e-6);
  }
}

/// A channel whose mean is large beside its deviation: sums of squares alone would lose it.
TEST_P(LayerForward, BatchNormOfChannelsFarFromZero) {
  Random random(10);
  Tensor x = random_tensor({4, 20, 10, 6}, random);
  for (float& value : x.values()) value = 3000.0F + std::round(value * 256.0F) / 256.0F;
  BatchNorm norm({.num_features = 6});
  Tensor y;
  norm.forward(x, y, Mode::training);
  const Array expected = oracle::batch_norm_training(Array(x), Array(norm.weight().value),
                                                     Array(norm.bias().value), 1e-5);
  EXPECT_LT(relative_error(y, expected), 1e-6);
}

TEST(BatchNorm, GivesTheSameBitsOnEveryTargetAndAnyNumberOfThreads) {
  Random random(11);
  const Tensor x = random_tensor({7, 31, 9, 37}, random);
  const Tensor dy = random_tensor(x.shape(), random);
  const int threads = omp_get_max_threads();
  std::vector<std::vector<float>> first;
  for (const std::string& target : simd_targets()) {
    use_simd_target(target);
    for (int count = 1; count <= 3; ++count) {
      omp_set_num_threads(count);
      BatchNorm norm({.num_features = 37});
      Tensor y;
      Tensor dx;
      norm.forward(x, y, Mode::training);
      norm.backward(x, y, dy, &dx);
      std::vector<std::vector<float>> run;
      for (const Tensor* tensor : {&y, &dx, &norm.weight().grad, &norm.bias().grad,
                                   &norm.running_mean().value, &norm.running_var().value}) {
        run.emplace_back(tensor->values().begin(), tensor->values().end());
      }
      if (first.empty()) first = run;
      EXPECT_EQ(run, first) << target << ", " << count << " threads";
    }
  }
  use_simd_target("");
  omp_set_num_threads(threads);
}

TEST(BatchNorm, RefusesABatchOfOneOnlyInTraining) {
  BatchNorm norm({.num_features = 3});
  Tensor y;
  EXPECT_THROW(norm.forward(Tensor({1, 1, 1, 3}), y, Mode::training), std::invalid_argument);
  EXPECT_NO_THROW(norm.forward(Tensor({1, 1, 1, 3}), y, Mode::inference));
}

TEST_P(LayerForward, InstanceNormLooksAtEachImageAlone) {
  Random random(12);
  for (const Shape in : {Shape{1, 1, 2, 1}, Shape{3, 5, 2, 4}, Shape{5, 31, 29, 11}}) {
    InstanceNorm norm({.num_features = in.c});
    norm.weight().value = random_tensor({1, 1, 1, in.c}, random);
    norm.bias().value = random_tensor({1, 1, 1, in.c}, random);
    const Tensor x = random_tensor(in, random);
    const Array expected =
        oracle::instance_norm(Array(x), Array(norm.weight().value), Array(norm.bias().value), 1e-5);
    for (const Mode mode : {Mode::training, Mode::inference}) {
      Tensor y;
      norm.forward(x, y, mode);
      EXPECT_LT(relative_error(y, expected), 1e-6);
    }
  }
}

TEST(InstanceNorm, RefusesAMapOfOnePosition) {
  InstanceNorm norm({.num_features = 3});
  Tensor y;
  EXPECT_THROW(norm.forward(Tensor({4, 1, 1, 3}), y, Mode::training), std::invalid_argument);
  EXPECT_THROW(norm.forward(Tensor({4, 1, 2, 4}), y, Mode::inference), std::invalid_argument);
}

TEST(L2Normalize, GivesUnitRowsAndKeepsZeroRows) {
  Random random(7);
  Tensor x = random_tensor({3, 1, 1, 128}, random);
  std::fill_n(x.image(1), 128, 0.0F);
  Tensor y;
  L2Normalize().forward(x, y, Mode::inference);
  EXPECT_LT(relative_error(y, oracle::l2_normalize(Array(x), 1e-12)), 1e-7);
  for (int i = 0; i < 128; ++i) EXPECT_EQ(y.image(1)[i], 0.0F);
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(LayerErrors, NameLayerShapeAndExpectation) {
  using testing::AllOf;
  using testing::HasSubstr;
  Tensor y;
  EXPECT_THAT(message_of([&] { Conv2d({.in_channels = 0, .out_channels = 4}); }),
              AllOf(HasSubstr("in_channels is 0"), HasSubstr(">= 1")));
  EXPECT_THAT(message_of([&] {
                Conv2d({.in_channels = 3, .out_channels = 4})
                    .forward(Tensor({1, 4, 4, 5}), y, Mode::inference);
              }),
              AllOf(HasSubstr("Conv2d"), HasSubstr("[1,4,4,5]"), HasSubstr("3 channels")));
  EXPECT_THAT(message_of([&] {
                Linear({.in_features = 8, .out_features = 4})
                    .forward(Tensor({1, 1, 1, 9}), y, Mode::inference);
              }),
              AllOf(HasSubstr("Linear"), HasSubstr("[1,1,1,9]"), HasSubstr("expected 8")));
  EXPECT_THAT(message_of([&] {
                MaxPool2d().forward(Tensor({1, 1, 4, 9}), y, Mode::inference);
              }),
              AllOf(HasSubstr("MaxPool2d"), HasSubstr("[1,1,4,9]")));
  EXPECT_THAT(message_of([&] { BatchNorm({.num_features = 3, .eps = 0.0}); }),
              AllOf(HasSubstr("eps"), HasSubstr("> 0")));
}

}  // namespace
}  // namespace sdmt::nn
