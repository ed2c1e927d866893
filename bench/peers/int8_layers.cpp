// SPDX-License-Identifier: Apache-2.0
// Each convolution of the network, with its ReLU: our float32 beside oneDNN's int8 (images u8,
// weights s8 with a scale for each output channel). Why the engine has no int8 is what it prints.
//   int8_layers [BATCH [ROUNDS]]      PEER_CPU_TIME=1 OMP_NUM_THREADS=1 on a busy machine
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <memory>
#include <oneapi/dnnl/dnnl.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "peer.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/random.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"

namespace {

using namespace sdmt;
using dnnl::memory;
using Tag = memory::format_tag;
using Type = memory::data_type;

struct LayerCase {
  const char* name;
  int height, width, in, out;
};
constexpr LayerCase kLayers[] = {{"conv1_1", 128, 64, 3, 64},   {"conv1_2", 128, 64, 64, 64},
                                 {"conv2_1", 64, 32, 64, 128},  {"conv2_2", 64, 32, 128, 128},
                                 {"conv3_1", 32, 16, 128, 256}, {"conv3_2", 32, 16, 256, 256},
                                 {"conv3_3", 32, 16, 256, 256}};

/// One layer quantised: inputs 0 to 1 as 0 to 255, outputs 0 to `largest` likewise.
class Int8Convolution {
 public:
  Int8Convolution(nn::Conv2d& conv, const nn::Tensor& x, float largest)
      : engine_(dnnl::engine::kind::cpu, 0), stream_(engine_) {
    const nn::Shape in = x.shape();
    const nn::Shape out = conv.output_shape(in);
    const nn::Tensor& weight = conv.weight().value;
    const std::size_t taps = weight.shape().image_size();
    std::vector<float> scales;
    std::vector<std::int8_t> quantised;
    for (int o = 0; o < out.c; ++o) {
      const float* const row = weight.image(o);
      float most = 0.0F;
      for (std::size_t i = 0; i < taps; ++i) most = std::max(most, std::abs(row[i]));
      for (std::size_t i = 0; i < taps; ++i) {
        quantised.push_back(static_cast<std::int8_t>(std::lround(row[i] / most * 127.0F)));
      }
      scales.push_back(most / 127.0F / largest);
    }
    dnnl::primitive_attr attributes;
    attributes.set_output_scales(1 << 1, scales);
    dnnl::post_ops operations;
    operations.append_eltwise(1.0F, dnnl::algorithm::eltwise_relu, 0.0F, 0.0F);
    attributes.set_post_ops(operations);
    const memory::dims source_dims{in.n, in.c, in.h, in.w};
    const memory::dims weight_dims{out.c, in.c, 3, 3};
    const memory::dims result_dims{out.n, out.c, out.h, out.w};
    const dnnl::convolution_forward::desc description(
        dnnl::prop_kind::forward_inference, dnnl::algorithm::convolution_auto,
        {source_dims, Type::u8, Tag::any}, {weight_dims, Type::s8, Tag::any},
        {result_dims, Type::u8, Tag::nhwc}, {1, 1}, {1, 1}, {1, 1});
    const dnnl::convolution_forward::primitive_desc primitive(description, attributes, engine_);
    implementation_ = primitive.impl_info_str();

    std::vector<std::uint8_t> pixels;
    for (const float value : x.values()) {
      pixels.push_back(static_cast<std::uint8_t>(std::lround(value * 255.0F)));
    }
    const memory plain_source({source_dims, Type::u8, Tag::nhwc}, engine_, pixels.data());
    const memory plain_weights({weight_dims, Type::s8, Tag::ohwi}, engine_, quantised.data());
    const memory source = reordered(plain_source, primitive.src_desc());
    const memory weights = reordered(plain_weights, primitive.weights_desc());
    result_ = memory(primitive.dst_desc(), engine_);
    primitive_ = dnnl::convolution_forward(primitive);
    arguments_ = {{DNNL_ARG_SRC, source}, {DNNL_ARG_WEIGHTS, weights}, {DNNL_ARG_DST, result_}};
  }

  void run() {
    primitive_.execute(stream_, arguments_);
    stream_.wait();
  }
  const std::uint8_t* values() const {
    return static_cast<const std::uint8_t*>(result_.get_data_handle());
  }
  const std::string& implementation() const { return implementation_; }

 private:
  memory reordered(memory from, const memory::desc& order) {
    memory to(order, engine_);
    dnnl::reorder(from, to).execute(stream_, from, to);
    stream_.wait();
    return to;
  }

  dnnl::engine engine_;
  dnnl::stream stream_;
  dnnl::primitive primitive_;
  memory result_;
  std::unordered_map<int, memory> arguments_;
  std::string implementation_;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void compare(int batch, int rounds) {
  double total[2] = {};
  std::printf("batch %d\n%-9s%15s%15s%8s%12s\n", batch, "", "sdmt float32", "oneDNN int8", "ratio",
              "int8 error");
  for (const LayerCase& layer : kLayers) {
    nn::Random random(1);
    auto owned = std::make_unique<nn::Conv2d>(
        nn::Conv2dOptions{.in_channels = layer.in, .out_channels = layer.out, .bias = false});
    nn::Conv2d& conv = *owned;
    conv.reset_parameters(random);
    nn::Sequential net;
    net.add("conv", std::move(owned)).add("relu", std::make_unique<nn::ReLU>());
    nn::Tensor x({batch, layer.height, layer.width, layer.in});
    for (float& value : x.values()) value = static_cast<float>(random.uniform(0.0, 1.0));
    const nn::Tensor y = net.forward(x, nn::Mode::inference);
    const float largest = *std::max_element(y.values().begin(), y.values().end());
    Int8Convolution int8(conv, x, largest);
    int8.run();
    double error = 0.0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      error += std::abs(static_cast<double>(int8.values()[i]) / 255.0 - y.values()[i] / largest);
    }
    error /= static_cast<double>(y.size());
    std::vector<double> times[2];
    for (int round = 0; round < rounds; ++round) {
      times[0].push_back(peers::milliseconds([&] { net.forward(x, nn::Mode::inference); }));
      times[1].push_back(peers::milliseconds([&] { int8.run(); }));
    }
    const double ours = median(times[0]);
    const double theirs = median(times[1]);
    total[0] += ours;
    total[1] += theirs;
    std::printf("%-9s%12.2f ms%12.2f ms%8.2f%12.4f  %s\n", layer.name, ours, theirs, ours / theirs,
                error, int8.implementation().c_str());
    if (!(error < 0.01)) throw std::runtime_error("these are not the same layer");
  }
  std::printf("%-9s%12.2f ms%12.2f ms%8.2f\n", "all", total[0], total[1], total[0] / total[1]);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    compare(argc > 1 ? std::atoi(argv[1]) : 8, argc > 2 ? std::atoi(argv[2]) : 15);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "int8_layers: %s\n", error.what());
    return 1;
  }
}
