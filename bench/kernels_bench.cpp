// SPDX-License-Identifier: Apache-2.0
// One case for each heavy layer of the paper's network, forward and backward, and the layers of
// lite in training. The rate counts the multiplications and additions of the direct
// convolution, whatever the kernel saves.
//   bench_nn --benchmark_filter='forward.*' --benchmark_min_time=1
#include <benchmark/benchmark.h>

#include <string>

#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/random.h"
#include "sdmt/nn/relu.h"
#include "sdmt/reid/architectures.h"
#include "sdmt/reid/embedding_network.h"

namespace sdmt::nn {
namespace {

struct ConvolutionCase {
  const char* name;
  int height, width, in, out;
  bool pool;
};

// Table 1 of the paper for crops of 128 x 64.
constexpr ConvolutionCase kConvolutions[] = {
    {"conv1_1", 128, 64, 3, 64, false},   {"conv1_2", 128, 64, 64, 64, true},
    {"conv2_1", 64, 32, 64, 128, false},  {"conv2_2", 64, 32, 128, 128, true},
    {"conv3_1", 32, 16, 128, 256, false}, {"conv3_2", 32, 16, 256, 256, false},
};

Tensor uniform_tensor(Shape shape) {
  Random random(1);
  Tensor tensor(shape);
  for (float& value : tensor.values()) value = static_cast<float>(random.uniform(-1.0, 1.0));
  return tensor;
}

void set_rate(benchmark::State& state, double flops) {
  state.counters["GFLOP/s"] = benchmark::Counter(
      flops * 1e-9 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

double flops(const ConvolutionCase& c, int batch) {
  return 18.0 * batch * c.height * c.width * c.in * c.out;
}

void forward(benchmark::State& state, const ConvolutionCase& c) {
  const int batch = static_cast<int>(state.range(0));
  Random random(2);
  auto conv = std::make_unique<Conv2d>(Conv2dOptions{.in_channels = c.in, .out_channels = c.out});
  conv->reset_parameters(random);
  Sequential net;
  net.add("conv", std::move(conv)).add("relu", std::make_unique<ReLU>());
  if (c.pool) net.add("pool", std::make_unique<MaxPool2d>());
  const Tensor x = uniform_tensor({batch, c.height, c.width, c.in});
  for (auto _ : state) net.forward(x, Mode::inference);
  set_rate(state, flops(c, batch));
}

/// Weight gradient alone, or data gradient alone.
void backward(benchmark::State& state, const ConvolutionCase& c, bool weights) {
  const int batch = static_cast<int>(state.range(0));
  Random random(2);
  Conv2d conv({.in_channels = c.in, .out_channels = c.out});
  conv.reset_parameters(random);
  conv.weight().trainable = conv.bias().trainable = weights;
  const Tensor x = uniform_tensor({batch, c.height, c.width, c.in});
  const Tensor dy = uniform_tensor({batch, c.height, c.width, c.out});
  Tensor dx;
  for (auto _ : state) conv.backward(x, dy, dy, weights ? nullptr : &dx);
  set_rate(state, flops(c, batch));
}

void fully_connected(benchmark::State& state, bool back) {
  const int batch = static_cast<int>(state.range(0));
  Random random(2);
  Linear linear({.in_features = 32 * 16 * 256, .out_features = 128});
  linear.reset_parameters(random);
  const Tensor x = uniform_tensor({batch, 32, 16, 256});
  const Tensor dy = uniform_tensor({batch, 1, 1, 128});
  Tensor y;
  Tensor dx;
  for (auto _ : state) {
    if (back) {
      linear.backward(x, dy, dy, &dx);
    } else {
      linear.forward(x, y, Mode::inference);
    }
  }
  set_rate(state, (back ? 4.0 : 2.0) * batch * 32 * 16 * 256 * 128);
}

/// A layer of lite's trunk alone, in training.
void lite_layer(benchmark::State& state, int index, bool back) {
  reid::EmbeddingNetwork network(reid::lite());
  network.initialize(3);
  Sequential& net = network.trunk();
  const Tensor images = uniform_tensor(network.input_shape(128));
  Tensor x = net.forward(images, Mode::training, 0, index);
  Tensor y;
  Tensor dx;
  Layer& layer = net.layer(index);
  layer.forward(x, y, Mode::training);
  const Tensor dy = uniform_tensor(y.shape());
  for (auto _ : state) {
    if (back) {
      layer.backward(x, y, dy, index == 0 ? nullptr : &dx);
    } else {
      layer.forward(x, y, Mode::training);
    }
  }
}

void register_lite() {
  constexpr auto kUnit = benchmark::kMillisecond;
  reid::EmbeddingNetwork network(reid::lite());
  const Sequential& net = network.trunk();
  for (int i = 0; i < net.size(); ++i) {
    for (const bool back : {false, true}) {
      const std::string name = std::string("lite/") + (back ? "backward/" : "forward/");
      benchmark::RegisterBenchmark((name + net.name(i)).c_str(), lite_layer, i, back)->Unit(kUnit);
    }
  }
}

void register_cases() {
  for (const ConvolutionCase& c : kConvolutions) {
    const std::string name = c.name;
    benchmark::RegisterBenchmark(("forward/" + name).c_str(), forward, c)->Arg(1)->Arg(8)->Arg(40);
    benchmark::RegisterBenchmark(("weight_gradient/" + name).c_str(), backward, c, true)->Arg(8);
    if (c.in == 3) continue;  // nothing below the first layer asks for it
    benchmark::RegisterBenchmark(("data_gradient/" + name).c_str(), backward, c, false)->Arg(8);
  }
  benchmark::RegisterBenchmark("forward/fc1", fully_connected, false)->Arg(1)->Arg(8)->Arg(40);
  benchmark::RegisterBenchmark("backward/fc1", fully_connected, true)->Arg(8)->Arg(128);
}

}  // namespace
}  // namespace sdmt::nn

int main(int argc, char** argv) {
  sdmt::nn::register_cases();
  sdmt::nn::register_lite();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
