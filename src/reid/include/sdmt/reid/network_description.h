// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sdmt/nn/tensor.h"

namespace sdmt::reid {

/// Kinds of layers that a network is made of, as PyTorch spells them, and what each needs said.
enum class LayerType {
  conv2d,           ///< "Conv2d": out_channels, kernel_size, stride, padding, bias
  batch_norm2d,     ///< "BatchNorm2d", over the positions of a map: initial_gamma, initial_beta
  instance_norm2d,  ///< "InstanceNorm2d", affine, over a map of one image: likewise
  relu,             ///< "ReLU"
  avg_pool2d,       ///< "AvgPool2d": means over blocks that fill the map, kernel_size [h, w]
  max_pool2d,       ///< "MaxPool2d": 2x2 with stride 2
  linear,           ///< "Linear", reads the whole map: out_features, bias
  batch_norm1d,     ///< "BatchNorm1d", behind a Linear: initial_gamma, initial_beta
  l2_normalize,     ///< "L2Normalize": onto the unit sphere
};

/// One layer. Numbers that its type does not need stay at their defaults, which are PyTorch's.
struct LayerDescription {
  std::string name;       ///< of letters, digits, '_' and '-'; no two layers have the same
  std::string stored_as;  ///< what its tensors are called in files, "features.0"; empty: as `name`
  LayerType type = LayerType::relu;
  int out_channels = 0;        ///< 1 to 65536
  int kernel_size = 0;         ///< 1 to 15, square
  int stride = 1;              ///< 1 to 15
  int padding = 0;             ///< zeros on every side, 0 to kernel_size - 1
  int block_height = 1;        ///< of AvgPool2d's kernel and stride, >= 1
  int block_width = 1;         ///< likewise
  int out_features = 0;        ///< 1 to 65536
  bool bias = true;            ///< of Conv2d and Linear
  float initial_gamma = 1.0F;  ///< where a batch normalisation starts, > 0
  float initial_beta = 0.0F;   ///< likewise, finite

  /// "<stored_as or name>.<parameter>", the name of a tensor in a model file.
  std::string tensor_name(std::string_view parameter) const;

  bool operator==(const LayerDescription&) const = default;
};

/// A network as data: a chain of layers that makes unit vectors of RGB patches. It begins with the
/// trunk (all before the first Linear, works on maps), goes on with the head, and ends in its only
/// L2Normalize.
struct NetworkDescription {
  std::string name;  ///< of the architecture; not empty
  int height = 128;  ///< of the input, 1 to 4096
  int width = 64;    ///< likewise
  std::vector<LayerDescription> layers;

  /// Throws std::invalid_argument naming the network, the layer, what is wrong with it and what was
  /// expected: a number out of range, a name used twice, a layer where its type cannot stand, a map
  /// that the layer does not fit. A map may hold 2^24 values a patch and a layer 2^29 weights, so
  /// that a description cannot ask for more memory than a machine has.
  void validate() const;

  /// [1, height, width, 3]
  nn::Shape input_shape() const { return {1, height, width, 3}; }
  /// Shapes for one patch: the input's, then what each layer makes of it; layers.size() + 1 of
  /// them. For a valid description.
  std::vector<nn::Shape> shapes() const;
  /// Index of the first Linear, where the head begins. For a valid description.
  int first_of_head() const;
  /// Length of the vector that the network makes of a patch. For a valid description.
  int embedding_size() const;

  bool operator==(const NetworkDescription&) const = default;
};

/// "Conv2d", ...
std::string_view layer_type_name(LayerType type);

/// The description as JSON text, a layer to a line:
/// {"name": "small", "input": {"height": 128, "width": 64}, "layers": [
///   {"name": "conv1", "type": "Conv2d", "out_channels": 32, "kernel_size": 3, "stride": 2,
///    "padding": 1, "bias": false}, {"name": "bn1", "type": "BatchNorm2d"}, ...]}
std::string to_json(const NetworkDescription& network);

/// Reads such text; what may be absent has the default of LayerDescription. Throws
/// std::invalid_argument beginning with `source`: for text that is no JSON, a key that is missing
/// or not known, a value of the wrong type, and as validate().
NetworkDescription parse_network_description(std::string_view json, const std::string& source);

}  // namespace sdmt::reid
