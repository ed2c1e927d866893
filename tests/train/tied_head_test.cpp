// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/tied_head.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "sdmt/nn/avg_pool2d.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/random.h"

namespace sdmt::train {
namespace {

using testing::HasSubstr;

reid::EmbeddingNetwork small_network() {
  reid::EmbeddingNetwork network(reid::vgg16(32, 16));  // a map of 8 x 4
  network.initialize(3);
  return network;
}

nn::Tensor random_tensor(nn::Shape shape, std::uint64_t seed) {
  nn::Random random(seed);
  nn::Tensor tensor(shape);
  for (float& value : tensor.values()) value = static_cast<float>(random.normal());
  return tensor;
}

nn::Tensor& fc1(nn::Sequential& head) {
  return dynamic_cast<nn::Linear&>(head.layer(head.index("fc1"))).weight().value;
}

TEST(TiedHead, ExpandedItIsTheSameFunction) {
  for (const BlockGrid grid :
       {BlockGrid{8, 2}, BlockGrid{2, 1}, BlockGrid{8, 4}, BlockGrid{1, 1}}) {
    reid::EmbeddingNetwork network = small_network();
    const auto tied = make_tied_head(network, grid);
    store_tied_head(*tied, grid, network);
    const nn::Tensor map = random_tensor({5, 8, 4, 256}, 7);
    const nn::Tensor expected = network.head().forward(map, nn::Mode::inference);
    const nn::Tensor& ours = tied->forward(map, nn::Mode::inference);
    ASSERT_EQ(ours.shape(), expected.shape());
    for (std::size_t i = 0; i < ours.size(); ++i) {
      EXPECT_NEAR(ours.data()[i], expected.data()[i], 1e-5);
    }
  }
}

TEST(TiedHead, ComesBackFromANetworkAsItWas) {
  const BlockGrid grid{4, 2};
  reid::EmbeddingNetwork network = small_network();
  const auto first = make_tied_head(network, grid);
  store_tied_head(*first, grid, network);
  const auto second = make_tied_head(network, grid);
  EXPECT_TRUE(std::equal(fc1(*first).values().begin(), fc1(*first).values().end(),
                         fc1(*second).values().begin()));
}

TEST(TiedHead, KeepsHeInitialisation) {
  reid::EmbeddingNetwork network = small_network();
  const auto tied = make_tied_head(network, {4, 2});
  double squares = 0;
  for (const float weight : fc1(*tied).values()) squares += weight * weight;
  const double inputs = 4 * 2 * 256;
  EXPECT_NEAR(squares / static_cast<double>(fc1(*tied).size()), 2 / inputs, 0.02 * 2 / inputs);
}

TEST(TiedHead, RefusesBlocksThatDoNotFit) {
  reid::EmbeddingNetwork network = small_network();
  for (const BlockGrid grid :
       {BlockGrid{3, 2}, BlockGrid{8, 3}, BlockGrid{0, 1}, BlockGrid{16, 1}}) {
    try {
      make_tied_head(network, grid);
      FAIL() << grid.rows << "x" << grid.columns;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr("expected rows x columns that divide the map of 8x4"));
    }
  }
}

TEST(AvgPool2d, IsTheMeanOfItsBlocks) {
  nn::AvgPool2d pool({2, 3});
  const nn::Tensor x = random_tensor({2, 4, 6, 3}, 1);
  nn::Tensor y;
  pool.forward(x, y, nn::Mode::training);
  ASSERT_EQ(y.shape(), (nn::Shape{2, 2, 2, 3}));
  const auto at = [&x](int n, int h, int w, int c) { return x.image(n)[(h * 6 + w) * 3 + c]; };
  for (int n = 0; n < 2; ++n) {
    for (int block = 0; block < 4; ++block) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int i = 0; i < 6; ++i) {
          sum += at(n, block / 2 * 2 + i / 3, block % 2 * 3 + i % 3, c);
        }
        EXPECT_NEAR(y.image(n)[block * 3 + c], sum / 6, 1e-6);
      }
    }
  }
}

TEST(AvgPool2d, GradientIsTheDerivative) {
  nn::AvgPool2d pool({2, 1});
  const nn::Tensor x = random_tensor({2, 4, 3, 2}, 2);
  nn::Tensor y, dx;
  pool.forward(x, y, nn::Mode::training);
  const nn::Tensor dy = random_tensor(y.shape(), 3);
  pool.backward(x, y, dy, &dx);
  ASSERT_EQ(dx.shape(), x.shape());
  // The layer is linear: <dy, f(e_i)> is the derivative exactly.
  for (std::size_t i = 0; i < x.size(); ++i) {
    nn::Tensor unit(x.shape());
    unit.data()[i] = 1;
    nn::Tensor response;
    pool.forward(unit, response, nn::Mode::training);
    double expected = 0;
    for (std::size_t j = 0; j < response.size(); ++j) expected += dy.data()[j] * response.data()[j];
    EXPECT_NEAR(dx.data()[i], expected, 1e-6);
  }
  EXPECT_NO_THROW(pool.backward(x, y, dy, nullptr));
}

TEST(AvgPool2d, RefusesMapsThatItsBlocksDoNotFill) {
  EXPECT_THROW(nn::AvgPool2d({0, 1}), std::invalid_argument);
  const nn::AvgPool2d pool({2, 3});
  EXPECT_THROW(static_cast<void>(pool.output_shape({1, 5, 6, 1})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pool.output_shape({1, 4, 7, 1})), std::invalid_argument);
}

}  // namespace
}  // namespace sdmt::train
