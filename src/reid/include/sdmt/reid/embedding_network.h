// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdmt/nn/layer.h"
#include "sdmt/nn/sequential.h"

namespace sdmt::reid {

/// Length of the vector that the network makes of a crop (the paper's table 1).
inline constexpr int kEmbeddingSize = 128;

struct EmbeddingNetworkOptions {
  int height = 128;  ///< of the input, a multiple of 4, 4..4096 (two poolings)
  int width = 64;    ///< as height
  /// Start of the batch normalisation before the unit sphere. With the usual gamma 1, beta 0 two
  /// random embeddings are sqrt(2) apart, far outside the margin 0.2, and the contrastive loss
  /// hardly learns; these values make the mean distance start near the margin. gamma > 0.
  float initial_gamma = 0.15F;
  float initial_beta = 1.0F;

  /// Values of the feature map that fc1 reads: height/4 * width/4 * 256.
  int features() const { return (height / 4) * (width / 4) * 256; }

  /// Throws std::invalid_argument naming the field, its value and the bound.
  void validate() const;
};

/// The network of the paper's table 1: VGG-16's conv1_1 .. conv3_3 with their ReLUs and the first
/// two poolings (the trunk: [n,128,64,3] -> [n,32,16,256]), then a fully connected layer to 128,
/// ReLU, another to 128, batch normalisation, and the projection to the unit sphere (the head).
class EmbeddingNetwork {
 public:
  /// All weights and biases are 0 until initialize() is called or a file is loaded.
  explicit EmbeddingNetwork(const EmbeddingNetworkOptions& options = {});
  ~EmbeddingNetwork();
  EmbeddingNetwork(EmbeddingNetwork&&) noexcept;
  EmbeddingNetwork& operator=(EmbeddingNetwork&&) noexcept;

  const EmbeddingNetworkOptions& options() const { return options_; }
  nn::Shape input_shape(int batch) const;

  /// Layers "conv1_1", "relu1_1", ..., "pool1", ..., "conv3_3", "relu3_3".
  nn::Sequential& trunk() { return *trunk_; }
  const nn::Sequential& trunk() const { return *trunk_; }
  /// Layers "fc1", "relu1", "fc2", "bn", "l2".
  nn::Sequential& head() { return *head_; }
  const nn::Sequential& head() const { return *head_; }

  /// Random weights in every convolution and fully connected layer (He et al., 2015: normal, mean
  /// 0, variance 2 / inputs), biases 0, batch normalisation as the options say. The same seed gives
  /// the same weights on any number of threads.
  void initialize(std::uint64_t seed);

  /// Trunk, then head: [n, height, width, 3] -> [n, 1, 1, 128], rows of length 1. The result is
  /// valid until the next call.
  const nn::Tensor& forward(const nn::Tensor& patches, nn::Mode mode);

  /// Gives up what only training and saving need, where inference has its own copy: with float16
  /// weights 67 MB. Only forward() in inference mode may follow.
  void release_for_inference();

  /// A tensor of the network that a model file holds.
  struct StoredTensor {
    std::string
        name;  ///< in the file: "features.0.weight" (as torchvision), "head.fc1.weight", ...
    std::vector<std::uint64_t>
        file_shape;  ///< as PyTorch has it: [out,in,kh,kw], [out,in] or [out]
    nn::Tensor* value;
    /// The file keeps PyTorch's order: the values of one output lie as [channels][positions] in the
    /// file and as [positions][channels] in memory. 9 for a 3x3 convolution, h * w for fc1 (which
    /// reads the flattened feature map), 1 where both orders are the same.
    int positions;
    nn::Parameter* parameter;  ///< nullptr for running statistics
  };
  /// All parameters and running statistics, trunk first, in a fixed order.
  const std::vector<StoredTensor>& stored_tensors() const { return stored_; }
  /// To be called after values were changed through stored_tensors().
  void parameters_changed();

 private:
  EmbeddingNetworkOptions options_;
  std::unique_ptr<nn::Sequential> trunk_;
  std::unique_ptr<nn::Sequential> head_;
  std::vector<StoredTensor> stored_;  // points into the layers, which never move
};

}  // namespace sdmt::reid
