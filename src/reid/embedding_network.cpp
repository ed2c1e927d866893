// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/embedding_network.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/random.h"
#include "sdmt/nn/relu.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::reid {

namespace {

constexpr int kImageChannels = 3;

// VGG-16 configuration D (Simonyan & Zisserman, 2015) as far as conv3_3. A pooling precedes the
// layers marked so; `index` is the layer's number in torchvision's vgg16().features.
struct TrunkLayer {
  const char* number;
  int out_channels;
  int index;
  bool pool_before;
};
constexpr TrunkLayer kTrunk[] = {
    {"1_1", 64, 0, false},  {"1_2", 64, 2, false},   {"2_1", 128, 5, true},  {"2_2", 128, 7, false},
    {"3_1", 256, 10, true}, {"3_2", 256, 12, false}, {"3_3", 256, 14, false}};
constexpr int kReduction = 4;  // of height and width, by two poolings

// The shape as PyTorch has it. In memory a parameter is [out,kh,kw,in], or [1,1,1,out].
std::vector<std::uint64_t> file_shape_of(const nn::Parameter& parameter, bool convolution) {
  const nn::Shape& shape = parameter.value.shape();
  const auto extent = [](int value) { return static_cast<std::uint64_t>(value); };
  if (parameter.name == "bias") return {extent(shape.c)};
  if (!convolution) return {extent(shape.n), shape.image_size()};
  return {extent(shape.n), extent(shape.c), extent(shape.h), extent(shape.w)};
}

}  // namespace

void EmbeddingNetworkOptions::validate() const {
  const auto check_side = [](const char* name, int value) {
    if (value < kReduction || value > 4096 || value % kReduction != 0) {
      throw std::invalid_argument(std::string("network input ") + name + " is " +
                                  std::to_string(value) +
                                  ", expected a multiple of 4 from 4 to 4096");
    }
  };
  check_side("height", height);
  check_side("width", width);
  if (!(initial_gamma > 0) || !std::isfinite(initial_gamma)) {
    throw std::invalid_argument("initial_gamma is " + std::to_string(initial_gamma) +
                                ", expected > 0");
  }
  if (!std::isfinite(initial_beta)) {
    throw std::invalid_argument("initial_beta is " + std::to_string(initial_beta) +
                                ", expected a finite number");
  }
}

EmbeddingNetwork::EmbeddingNetwork(const EmbeddingNetworkOptions& options)
    : options_(options),
      trunk_(std::make_unique<nn::Sequential>()),
      head_(std::make_unique<nn::Sequential>()) {
  options_.validate();
  const auto store = [this](const std::string& prefix, nn::Layer& layer, int positions) {
    for (nn::Parameter* parameter : layer.parameters()) {
      stored_.push_back({prefix + "." + parameter->name,
                         file_shape_of(*parameter, layer.type() == "Conv2d"), &parameter->value,
                         parameter->name == "weight" ? positions : 1, parameter});
    }
  };

  int channels = kImageChannels;
  int pools = 0;
  for (const TrunkLayer& spec : kTrunk) {
    const std::string number = spec.number;
    if (spec.pool_before) {
      trunk_->add("pool" + std::to_string(++pools), std::make_unique<nn::MaxPool2d>());
    }
    auto convolution = std::make_unique<nn::Conv2d>(
        nn::Conv2dOptions{.in_channels = channels, .out_channels = spec.out_channels});
    const int kernel = convolution->options().kernel_size;
    store("features." + std::to_string(spec.index), *convolution, kernel * kernel);
    trunk_->add("conv" + number, std::move(convolution));
    trunk_->add("relu" + number, std::make_unique<nn::ReLU>());
    channels = spec.out_channels;
  }

  const int positions = (options_.height / kReduction) * (options_.width / kReduction);
  const auto add_linear = [&](const std::string& name, int inputs, int input_positions) {
    auto linear = std::make_unique<nn::Linear>(
        nn::LinearOptions{.in_features = inputs, .out_features = kEmbeddingSize});
    store("head." + name, *linear, input_positions);
    head_->add(name, std::move(linear));
  };
  add_linear("fc1", options_.features(), positions);
  head_->add("relu1", std::make_unique<nn::ReLU>());
  add_linear("fc2", kEmbeddingSize, 1);

  auto norm =
      std::make_unique<nn::BatchNorm>(nn::BatchNormOptions{.num_features = kEmbeddingSize,
                                                           .initial_gamma = options_.initial_gamma,
                                                           .initial_beta = options_.initial_beta});
  for (nn::Parameter* parameter : norm->parameters()) {
    stored_.push_back(
        {"head.bn." + parameter->name, {kEmbeddingSize}, &parameter->value, 1, parameter});
  }
  for (nn::Buffer* buffer : norm->buffers()) {
    stored_.push_back({"head.bn." + buffer->name, {kEmbeddingSize}, &buffer->value, 1, nullptr});
  }
  head_->add("bn", std::move(norm));
  head_->add("l2", std::make_unique<nn::L2Normalize>());
}

EmbeddingNetwork::~EmbeddingNetwork() = default;
EmbeddingNetwork::EmbeddingNetwork(EmbeddingNetwork&&) noexcept = default;
EmbeddingNetwork& EmbeddingNetwork::operator=(EmbeddingNetwork&&) noexcept = default;

nn::Shape EmbeddingNetwork::input_shape(int batch) const {
  return {batch, options_.height, options_.width, kImageChannels};
}

void EmbeddingNetwork::initialize(std::uint64_t seed) {
  std::uint64_t stream = 0;
  for (nn::Sequential* part : {trunk_.get(), head_.get()}) {
    for (int i = 0; i < part->size(); ++i) {
      nn::Random random(seed, stream++);
      nn::Layer& layer = part->layer(i);
      if (auto* convolution = dynamic_cast<nn::Conv2d*>(&layer)) {
        convolution->reset_parameters(random);
      } else if (auto* linear = dynamic_cast<nn::Linear*>(&layer)) {
        linear->reset_parameters(random);
      } else if (auto* norm = dynamic_cast<nn::BatchNorm*>(&layer)) {
        norm->weight().value.fill(options_.initial_gamma);
        norm->bias().value.fill(options_.initial_beta);
        norm->running_mean().value.fill(0.0F);
        norm->running_var().value.fill(1.0F);
      }
    }
  }
  parameters_changed();
}

const nn::Tensor& EmbeddingNetwork::forward(const nn::Tensor& patches, nn::Mode mode) {
  return head_->forward(trunk_->forward(patches, mode), mode);
}

void EmbeddingNetwork::release_for_inference() {
  dynamic_cast<nn::Linear&>(head_->layer(head_->index("fc1"))).release_weights();
}

void EmbeddingNetwork::parameters_changed() {
  trunk_->parameters_changed();
  head_->parameters_changed();
}

}  // namespace sdmt::reid
