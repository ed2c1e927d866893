// SPDX-License-Identifier: Apache-2.0
#include "trained_network.h"

#include "hash.h"
#include "sdmt/nn/batch_norm.h"

namespace sdmt::train {

TrainedNetwork::TrainedNetwork(reid::EmbeddingNetwork& network, std::optional<BlockGrid> tie,
                               const std::string& first_trained, float trunk_lr_scale)
    : network_(network), tie_(tie) {
  if (tie_) tied_ = make_tied_head(network_, *tie_);
  nn::Sequential& trunk = network_.trunk();
  const bool head_only = first_trained == network_.head().name(0);
  trunk_cut_ = head_only ? trunk.size() : trunk.index(first_trained);
  head_cut_ = tie_ && trunk_cut_ == trunk.size() ? 1 : 0;
  for (int i = 0; i < trunk.size(); ++i) {
    for (nn::Parameter* parameter : trunk.layer(i).parameters()) {
      parameter->trainable = i >= trunk_cut_;
      parameter->lr_scale = trunk_lr_scale;
    }
  }
}

nn::Shape TrainedNetwork::front_shape(int batch) const {
  const nn::Shape map = network_.trunk().output_shape(network_.input_shape(batch), 0, trunk_cut_);
  return tied_ ? tied_->output_shape(map, 0, head_cut_) : map;
}

const nn::Tensor& TrainedNetwork::run_front(const nn::Tensor& patches) {
  const nn::Tensor& map = network_.trunk().forward(patches, nn::Mode::inference, 0, trunk_cut_);
  return head().forward(map, nn::Mode::inference, 0, head_cut_);
}

void TrainedNetwork::freeze_statistics() {
  for (nn::Sequential* part : {&network_.trunk(), &head()}) {
    for (int i = 0; i < part->size(); ++i) {
      if (auto* norm = dynamic_cast<nn::BatchNorm*>(&part->layer(i))) norm->freeze_statistics(true);
    }
  }
}

void TrainedNetwork::set_shards(const nn::BatchShards* shards) {
  network_.trunk().set_shards(shards);
  head().set_shards(shards);
}

const nn::Tensor& TrainedNetwork::forward(const nn::Tensor& front, nn::Mode mode) {
  const nn::Tensor& map = network_.trunk().forward(front, mode, trunk_cut_);
  return head().forward(map, mode, head_cut_);
}

void TrainedNetwork::backward(const nn::Tensor& dy) {
  if (trunk_cut_ == network_.trunk().size()) {
    head().backward(dy);
    return;
  }
  head().backward(dy, &map_gradient_);
  network_.trunk().backward(map_gradient_);
}

std::vector<nn::NamedParameter> TrainedNetwork::parameters() {
  std::vector<nn::NamedParameter> result;
  for (auto& [name, parameter] : network_.trunk().named_parameters()) {
    if (parameter->trainable) result.push_back({"trunk." + name, parameter});
  }
  for (auto& [name, parameter] : head().named_parameters()) {
    result.push_back({"head." + name, parameter});
  }
  return result;
}

std::vector<nn::NamedTensor> TrainedNetwork::state() {
  std::vector<nn::NamedTensor> result;
  for (auto& [name, parameter] : parameters()) result.push_back({name, &parameter->value});
  nn::Sequential& trunk = network_.trunk();
  for (int i = trunk_cut_; i < trunk.size(); ++i) {
    for (nn::Buffer* buffer : trunk.layer(i).buffers()) {
      result.push_back({"trunk." + trunk.name(i) + "." + buffer->name, &buffer->value});
    }
  }
  for (auto& [name, tensor] : head().named_buffers()) result.push_back({"head." + name, tensor});
  return result;
}

void TrainedNetwork::parameters_changed() {
  if (trunk_cut_ < network_.trunk().size()) network_.trunk().parameters_changed();
  head().parameters_changed();
}

void TrainedNetwork::store() {
  if (tied_) store_tied_head(*tied_, *tie_, network_);
}

std::uint64_t TrainedNetwork::front_fingerprint() {
  std::uint64_t state = kEmptyHash;
  for (int i = 0; i < trunk_cut_; ++i) {
    nn::Layer& layer = network_.trunk().layer(i);
    for (const nn::Parameter* parameter : layer.parameters()) hash(state, parameter->value);
    for (const nn::Buffer* buffer : layer.buffers()) hash(state, buffer->value);
  }
  return state;
}

std::uint64_t TrainedNetwork::state_fingerprint() {
  std::uint64_t fingerprint = kEmptyHash;
  for (const auto& [name, tensor] : state()) hash(fingerprint, *tensor);
  return fingerprint;
}

}  // namespace sdmt::train
