// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/embedding_network.h"

#include <utility>

#include "sdmt/nn/avg_pool2d.h"
#include "sdmt/nn/batch_norm.h"
#include "sdmt/nn/conv2d.h"
#include "sdmt/nn/instance_norm.h"
#include "sdmt/nn/l2_normalize.h"
#include "sdmt/nn/linear.h"
#include "sdmt/nn/max_pool2d.h"
#include "sdmt/nn/random.h"
#include "sdmt/nn/relu.h"

namespace sdmt::reid {

std::unique_ptr<nn::Layer> make_layer(const LayerDescription& description, const nn::Shape& in) {
  switch (description.type) {
    case LayerType::conv2d:
      return std::make_unique<nn::Conv2d>(
          nn::Conv2dOptions{.in_channels = in.c,
                            .out_channels = description.out_channels,
                            .kernel_size = description.kernel_size,
                            .stride = description.stride,
                            .padding = description.padding,
                            .bias = description.bias});
    case LayerType::linear:
      return std::make_unique<nn::Linear>(
          nn::LinearOptions{.in_features = in.h * in.w * in.c,
                            .out_features = description.out_features,
                            .bias = description.bias});
    case LayerType::batch_norm1d:
    case LayerType::batch_norm2d:
      return std::make_unique<nn::BatchNorm>(
          nn::BatchNormOptions{.num_features = in.c,
                               .initial_gamma = description.initial_gamma,
                               .initial_beta = description.initial_beta});
    case LayerType::instance_norm2d:
      return std::make_unique<nn::InstanceNorm>(
          nn::InstanceNormOptions{.num_features = in.c,
                                  .initial_gamma = description.initial_gamma,
                                  .initial_beta = description.initial_beta});
    case LayerType::relu:
      return std::make_unique<nn::ReLU>();
    case LayerType::max_pool2d:
      return std::make_unique<nn::MaxPool2d>();
    case LayerType::avg_pool2d:
      return std::make_unique<nn::AvgPool2d>(
          nn::AvgPool2dOptions{description.block_height, description.block_width});
    case LayerType::l2_normalize:
      return std::make_unique<nn::L2Normalize>();
  }
  return nullptr;
}

EmbeddingNetwork::EmbeddingNetwork(NetworkDescription description)
    : description_(std::move(description)),
      trunk_(std::make_unique<nn::Sequential>()),
      head_(std::make_unique<nn::Sequential>()) {
  description_.validate();
  embedding_size_ = description_.embedding_size();
  const std::vector<nn::Shape> shapes = description_.shapes();
  const int first_of_head = description_.first_of_head();
  int index = 0;
  for (const LayerDescription& layer : description_.layers) {
    auto made = make_layer(layer, shapes[index]);
    for (nn::Parameter* parameter : made->parameters()) {
      state_.push_back({index, parameter->name, &parameter->value, parameter});
    }
    for (nn::Buffer* buffer : made->buffers()) {
      state_.push_back({index, buffer->name, &buffer->value, nullptr});
    }
    (index < first_of_head ? trunk_ : head_)->add(layer.name, std::move(made));
    ++index;
  }
}

EmbeddingNetwork::~EmbeddingNetwork() = default;
EmbeddingNetwork::EmbeddingNetwork(EmbeddingNetwork&&) noexcept = default;
EmbeddingNetwork& EmbeddingNetwork::operator=(EmbeddingNetwork&&) noexcept = default;

nn::Shape EmbeddingNetwork::input_shape(int batch) const {
  nn::Shape shape = description_.input_shape();
  shape.n = batch;
  return shape;
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
        norm->weight().value.fill(norm->options().initial_gamma);
        norm->bias().value.fill(norm->options().initial_beta);
        norm->running_mean().value.fill(0.0F);
        norm->running_var().value.fill(1.0F);
      } else if (auto* instance_norm = dynamic_cast<nn::InstanceNorm*>(&layer)) {
        instance_norm->weight().value.fill(instance_norm->options().initial_gamma);
        instance_norm->bias().value.fill(instance_norm->options().initial_beta);
      }
    }
  }
  parameters_changed();
}

const nn::Tensor& EmbeddingNetwork::infer(const nn::Tensor& patches, Workspace& workspace) const {
  return head_->infer(trunk_->infer(patches, workspace.trunk), workspace.head);
}

const nn::Tensor& EmbeddingNetwork::forward(const nn::Tensor& patches, nn::Mode mode) {
  return head_->forward(trunk_->forward(patches, mode), mode);
}

void EmbeddingNetwork::release_for_inference() {
  trunk_->release_for_inference();
  head_->release_for_inference();
}

void EmbeddingNetwork::parameters_changed() {
  trunk_->parameters_changed();
  head_->parameters_changed();
}

}  // namespace sdmt::reid
