// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sdmt/io/safetensors.h"
#include "sdmt/reid/embedding_network.h"
#include "sdmt/reid/model_metadata.h"

namespace sdmt::reid {

/// A network and what is known about it.
struct Model {
  ModelMetadata metadata;
  EmbeddingNetwork network;
  std::string source = "the model";  ///< for messages: the file it was read from
};

/// A model of that architecture with random weights, see EmbeddingNetwork::initialize().
Model untrained_model(const NetworkDescription& network, std::uint64_t seed);

/// A tensor of a network as a model file holds it.
struct StoredTensor {
  std::string name;                       ///< in the file; see LayerDescription::tensor_name()
  std::vector<std::uint64_t> file_shape;  ///< as PyTorch has it: [out,in,kh,kw], [out,in] or [out]
  /// The file keeps PyTorch's order: the values of one output lie as [channels][positions] in the
  /// file and as [positions][channels] in memory. 9 for a 3x3 convolution, h * w for a Linear that
  /// reads a map of h x w, 1 where both orders are the same.
  int positions = 1;
  nn::Tensor* value = nullptr;
  nn::Parameter* parameter = nullptr;  ///< nullptr for running statistics
};
/// All parameters and running statistics of the network, in the order of its layers. After values
/// were changed through them, network.parameters_changed() must be called.
std::vector<StoredTensor> stored_tensors(const EmbeddingNetwork& network);

/// How a file keeps the weights of convolutions and fully connected layers. Biases and batch
/// normalisation are always float32.
/// float16: rounded to nearest even. int8: q = round(w / s), s = max|w| / 127 for each output
/// channel; tensor X of type I8 has a companion "X.scale", F32 [outputs], and w = q * s.
enum class Storage { float32, float16, int8 };

/// Key of the file's `__metadata__` under which the model's JSON text stands.
inline constexpr const char* kModelMetadataKey = "sdmt";

/// Reads a model file of any storage. Throws std::invalid_argument naming file, tensor, what was
/// found and what was expected; a missing tensor's message also names the first ones of
/// the file and a prefix that all names have, as "module.". Tensors that the network does not know
/// are ignored, so that checkpoints can be read as models.
Model load_model(const std::filesystem::path& path);
Model read_model(const io::Safetensors& file);

/// Writes the model, whole or not at all. Throws as OutputFile, and std::invalid_argument when the
/// metadata is not valid.
void save_model(const std::filesystem::path& path, const Model& model,
                Storage storage = Storage::float32);
/// Adds the model's tensors and metadata to a file that is to hold more (a checkpoint). The network
/// must live until the file is written.
void add_model(io::SafetensorsWriter& writer, const Model& model, Storage storage);

/// Replaces the metadata of a model file; its tensors keep their bytes. Throws as load_model() and
/// save_model() do.
void rewrite_metadata(const std::filesystem::path& path, const ModelMetadata& metadata);

/// Replaces the trunk's weights by those of a file that holds them under the names that a model
/// file has, and perhaps others (for vgg16: torchvision's VGG-16). Returns the names of the file's
/// other tensors, which are ignored. Throws std::invalid_argument naming file and tensor when one
/// is missing or has another shape; the network is then unchanged.
std::vector<std::string> load_trunk(const std::filesystem::path& path, EmbeddingNetwork& network);

}  // namespace sdmt::reid
