// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/sequential.h"
#include "sdmt/reid/architectures.h"
#include "sdmt/reid/network_description.h"

namespace sdmt::reid {

/// The layer that `description` says, for inputs of shape `in`; its weights are 0.
std::unique_ptr<nn::Layer> make_layer(const LayerDescription& description, const nn::Shape& in);

/// A network that turns patches into unit vectors, built from its description. infer() may run in
/// several threads at once, each with a workspace of its own; nothing else may beside it.
class EmbeddingNetwork {
 public:
  /// All weights and biases are 0 until initialize() is called or a file is loaded. Throws as
  /// NetworkDescription::validate().
  explicit EmbeddingNetwork(NetworkDescription description = vgg16());
  ~EmbeddingNetwork();
  EmbeddingNetwork(EmbeddingNetwork&&) noexcept;
  EmbeddingNetwork& operator=(EmbeddingNetwork&&) noexcept;

  const NetworkDescription& description() const { return description_; }
  /// [batch, height, width, 3]
  nn::Shape input_shape(int batch) const;
  /// Values of the vector made of a patch.
  int embedding_size() const { return embedding_size_; }

  /// The layers before the first Linear, under the names of the description.
  nn::Sequential& trunk() { return *trunk_; }
  const nn::Sequential& trunk() const { return *trunk_; }
  /// The layers from the first Linear on.
  nn::Sequential& head() { return *head_; }
  const nn::Sequential& head() const { return *head_; }

  /// Random weights in every convolution and fully connected layer (He et al., 2015: normal, mean
  /// 0, variance 2 / inputs), biases 0, batch normalisation as the description says. The same seed
  /// gives the same weights on any number of threads.
  void initialize(std::uint64_t seed);

  /// What lies between the layers in inference; one for each thread that runs the network.
  struct Workspace {
    nn::InferenceWorkspace trunk;
    nn::InferenceWorkspace head;
  };
  /// Trunk, then head: [n, height, width, 3] -> [n, 1, 1, embedding_size()], rows of length 1. The
  /// result lies in the workspace.
  const nn::Tensor& infer(const nn::Tensor& patches, Workspace& workspace) const;
  /// The same in either mode; the result is valid until the next call.
  const nn::Tensor& forward(const nn::Tensor& patches, nn::Mode mode);

  /// Gives up what only training and saving need, where inference has its own copy: with float16
  /// weights 67 MB of vgg16, and what batch normalisations are folded into, 7 MB of lite. Only
  /// infer(), or forward() in inference mode, may follow.
  void release_for_inference();

  /// A parameter or running statistic of the network.
  struct StateTensor {
    int layer = 0;          ///< its layer, an index into description().layers
    std::string parameter;  ///< within the layer: "weight", "bias", "running_mean", "running_var"
    nn::Tensor* value = nullptr;
    nn::Parameter* learnt = nullptr;  ///< nullptr for running statistics
  };
  /// All of them in the order of the layers. After a change through them parameters_changed() must
  /// be called.
  const std::vector<StateTensor>& state() const { return state_; }
  void parameters_changed();

 private:
  NetworkDescription description_;
  int embedding_size_ = 0;
  std::unique_ptr<nn::Sequential> trunk_;
  std::unique_ptr<nn::Sequential> head_;
  std::vector<StateTensor> state_;  // points into the layers, which never move
};

}  // namespace sdmt::reid
