// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/batch_shards.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "nn/random_tensor.h"
#include "nn/thread_group.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::nn {
namespace {

TEST(BatchShards, EveryImageIsInOneShardOfOneProcess) {
  for (const int images : {16, 17, 100, 128, 160}) {
    for (int size = 1; size <= kShards; ++size) {
      int next = 0;
      for (int rank = 0; rank < size; ++rank) {
        struct Fake : ProcessGroup {
          using ProcessGroup::ProcessGroup;
          void gather(std::span<std::byte>, std::span<const std::size_t>) override {}
          void broadcast(std::span<std::byte>) override {}
          void reduce(std::span<const float>, std::vector<std::span<float>>) override {}
          void wait() override {}
        } group(rank, size);
        const BatchShards shards(images, group);
        EXPECT_EQ(shards.begin(shards.first()), next);
        EXPECT_GT(shards.images_here(), 0);
        next += shards.images_here();
      }
      EXPECT_EQ(next, images);
    }
  }
}

TEST(BatchShards, NodesAreTheLargestSubtrees) {
  const auto text = [](int first, int end) {
    std::string nodes;
    for (const ShardNode node : shard_nodes(first, end)) {
      nodes += std::to_string(node.first) + "+" + std::to_string(node.count) + " ";
    }
    return nodes;
  };
  EXPECT_EQ(text(0, 16), "0+16 ");
  EXPECT_EQ(text(8, 16), "8+8 ");
  EXPECT_EQ(text(0, 5), "0+4 4+1 ");
  EXPECT_EQ(text(5, 10), "5+1 6+2 8+2 ");
  EXPECT_EQ(text(1, 16), "1+1 2+2 4+4 8+8 ");
}

TEST(BatchShards, SmallBatchesAndLargeGroupsAreRefused) {
  EXPECT_NO_THROW(BatchShards(3));
  EXPECT_THROW(ThreadGroup::run(2, [](ProcessGroup& group) { BatchShards(15, group); }),
               std::invalid_argument);
  ThreadGroup::Shared shared(1);
  EXPECT_THROW(ThreadGroup(0, 17, shared), std::invalid_argument);
}

// Convolutions by each of their three ways, both normalisations, pooling and a matrix.
Sequential network() {
  Sequential layers;
  Random random(1, 0);
  const auto convolution = [&](const std::string& name, Conv2dOptions options) {
    auto layer = std::make_unique<Conv2d>(options);
    layer->reset_parameters(random);
    layers.add(name, std::move(layer));
  };
  convolution("conv1", {.in_channels = 3, .out_channels = 32});
  layers.add("in1", std::make_unique<InstanceNorm>(InstanceNormOptions{32}));
  layers.add("relu1", std::make_unique<ReLU>());
  convolution("conv2", {.in_channels = 32, .out_channels = 24});
  layers.add("bn2", std::make_unique<BatchNorm>(BatchNormOptions{24}));
  layers.add("relu2", std::make_unique<ReLU>());
  layers.add("pool2", std::make_unique<MaxPool2d>());
  convolution("conv3", {.in_channels = 24, .out_channels = 20, .kernel_size = 1, .padding = 0});
  layers.add("relu3", std::make_unique<ReLU>());
  auto linear = std::make_unique<Linear>(LinearOptions{4 * 3 * 20, 33});
  linear->reset_parameters(random);
  layers.add("fc", std::move(linear));
  layers.add("bn", std::make_unique<BatchNorm>(BatchNormOptions{33}));
  layers.parameters_changed();
  return layers;
}

// All gradients, the running statistics and dL/dx after one pass of a whole batch.
std::vector<float> pass(ProcessGroup& group, int images) {
  Sequential layers = network();
  layers.layer(layers.index("conv2")).parameters()[1]->trainable = false;
  const Shape image{images, 8, 6, 3};
  Random random(7, 0);
  Tensor x = random_tensor(image, random), dy = random_tensor({images, 1, 1, 33}, random);
  const BatchShards shards(images, group);
  layers.set_shards(&shards);
  const int first = shards.begin(shards.first());
  const Tensor here = x.images(first, shards.images_here());
  const Tensor& y = layers.forward(here, Mode::training);
  std::vector<float> outputs(dy.size());
  std::ranges::copy(y.values(), outputs.begin() + first * 33);
  shards.gather_images(outputs, 33);
  Tensor dx;
  layers.backward(dy.images(first, shards.images_here()), &dx);
  group.wait();
  std::vector<float> inputs(x.size());
  std::ranges::copy(dx.values(),
                    inputs.begin() + static_cast<std::ptrdiff_t>(first * image.image_size()));
  shards.gather_images(inputs, image.image_size());
  outputs.insert(outputs.end(), inputs.begin(), inputs.end());
  for (const auto& [name, parameter] : layers.named_parameters()) {
    EXPECT_EQ(parameter->grad.empty(), !parameter->trainable) << name;
    outputs.insert(outputs.end(), parameter->grad.values().begin(), parameter->grad.values().end());
  }
  for (const auto& [name, tensor] : layers.named_buffers()) {
    outputs.insert(outputs.end(), tensor->values().begin(), tensor->values().end());
  }
  return outputs;
}

TEST(BatchShards, AnyNumberOfProcessesGivesTheSameBits) {
  for (const int images : {16, 21, 48}) {
    const auto alone = pass(ProcessGroup::alone(), images);
    EXPECT_TRUE(std::ranges::all_of(alone, [](float value) { return std::isfinite(value); }));
    for (const int size : {2, 3, 4, 7, 16}) {
      ThreadGroup::run(size, [&](ProcessGroup& group) {
        EXPECT_EQ(pass(group, images), alone)
            << images << " images, process " << group.rank() << " of " << size;
      });
    }
  }
}

TEST(BatchShards, ThreadsDoNotChangeTheBits) {
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const auto one = pass(ProcessGroup::alone(), 40);
  omp_set_num_threads(3);
  EXPECT_EQ(pass(ProcessGroup::alone(), 40), one);
  omp_set_num_threads(threads);
}

}  // namespace
}  // namespace sdmt::nn
