// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/model_file.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <set>
#include <stdexcept>
#include <utility>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/first_error.h"
#include "sdmt/io/half.h"

namespace sdmt::reid {

namespace {

constexpr float kInt8Max = 127.0F;
const std::string kScaleSuffix = ".scale";

[[noreturn]] void refuse(const std::string& file, const std::string& tensor,
                         const std::string& what) {
  throw std::invalid_argument(file + ": tensor " + tensor + " " + what);
}

// A file of another naming scheme is best recognised by the names that it has.
void require_present(const io::Safetensors& file, const std::string& name) {
  if (file.find(name) != nullptr) return;
  constexpr std::size_t kShown = 3;
  std::string found, prefix;
  std::size_t count = 0;
  for (const io::SafetensorsEntry& entry : file.tensors()) {
    if (count < kShown) found += (found.empty() ? "" : ", ") + io::printable(entry.name, 100);
    if (count == kShown) found += ", ...";
    ++count;
    if (entry.name.ends_with("." + name)) {
      prefix = entry.name.substr(0, entry.name.size() - name.size());
    }
  }
  std::string what = "is missing; the file has " + (found.empty() ? "no tensors" : found);
  if (!prefix.empty())
    what += "; take the prefix \"" + io::printable(prefix, 100) + "\" off its names";
  refuse(file.name(), name, what);
}

std::uint64_t extent(int value) { return static_cast<std::uint64_t>(value); }

// Shape in the file, and positions, of the weight of a convolution or Linear that reads maps `in`.
struct WeightLayout {
  WeightLayout(const LayerDescription& layer, const nn::Shape& in) {
    if (layer.type == LayerType::conv2d) {
      const int kernel = layer.kernel_size;
      shape = {extent(layer.out_channels), extent(in.c), extent(kernel), extent(kernel)};
      positions = kernel * kernel;
    } else {
      shape = {extent(layer.out_features), in.image_size()};
      positions = in.h * in.w;
    }
  }
  std::vector<std::uint64_t> shape;
  int positions;
};

bool has_matrix(const LayerDescription& layer) {
  return layer.type == LayerType::conv2d || layer.type == LayerType::linear;
}

// A file without the values must not make us take the memory that its description asks for.
void require_weights(const io::Safetensors& file, const NetworkDescription& network) {
  const std::vector<nn::Shape> shapes = network.shapes();
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    const LayerDescription& layer = network.layers[i];
    if (!has_matrix(layer)) continue;
    require_present(file, layer.tensor_name("weight"));
    file.at(layer.tensor_name("weight"), WeightLayout(layer, shapes[i]).shape);
  }
}

// out[j][i] = in[i][j], in small blocks so that both sides stay in the first-level cache.
void transpose(const float* in, int rows, int columns, float* out) {
  constexpr int kBlock = 16;
  for (int i0 = 0; i0 < rows; i0 += kBlock) {
    const int i1 = std::min(rows, i0 + kBlock);
    for (int j0 = 0; j0 < columns; j0 += kBlock) {
      const int j1 = std::min(columns, j0 + kBlock);
      for (int j = j0; j < j1; ++j) {
        for (int i = i0; i < i1; ++i) {
          out[static_cast<std::ptrdiff_t>(j) * rows + i] =
              in[static_cast<std::ptrdiff_t>(i) * columns + j];
        }
      }
    }
  }
}

// Weights have one row for each output, everything else is one row.
struct Rows {
  explicit Rows(const StoredTensor& tensor)
      : count(tensor.file_shape.size() > 1 ? tensor.value->shape().n : 1),
        size(tensor.value->size() / static_cast<std::size_t>(count)),
        positions(tensor.positions),
        channels(static_cast<int>(size) / positions) {}

  int count;
  std::size_t size;
  int positions;
  int channels;
};

bool is_weight(const StoredTensor& tensor) { return tensor.file_shape.size() > 1; }

const io::SafetensorsEntry& checked_entry(const io::Safetensors& file, const StoredTensor& tensor) {
  require_present(file, tensor.name);
  const io::SafetensorsEntry& entry = file.at(tensor.name, tensor.file_shape);
  switch (entry.dtype) {
    case io::DType::f32:
    case io::DType::f16:
    case io::DType::bf16:
    case io::DType::f64:
      return entry;
    case io::DType::i8:
      if (is_weight(tensor)) {
        require_present(file, tensor.name + kScaleSuffix);
        const std::uint64_t outputs = tensor.file_shape.front();
        const auto& scale = file.at(tensor.name + kScaleSuffix, {&outputs, 1});
        if (scale.dtype == io::DType::f32) return entry;
        refuse(file.name(), scale.name,
               "has dtype " + std::string(io::dtype_name(scale.dtype)) + ", expected F32");
      }
      [[fallthrough]];
    default:
      refuse(file.name(), tensor.name,
             "has dtype " + std::string(io::dtype_name(entry.dtype)) +
                 ", expected F32, F16, BF16, F64" + (is_weight(tensor) ? " or I8" : ""));
  }
}

// Fills `out`, which has the shape of tensor.value, row by row: widened, scaled, reordered.
void read_tensor(const io::Safetensors& file, const StoredTensor& tensor, nn::Tensor& out) {
  const io::SafetensorsEntry& entry = checked_entry(file, tensor);
  const Rows rows(tensor);
  std::vector<float> scales;
  if (entry.dtype == io::DType::i8) {
    scales.resize(static_cast<std::size_t>(rows.count));
    file.read_floats(file.at(tensor.name + kScaleSuffix), scales);
  }
  bool finite = true;
  io::FirstError error;
#pragma omp parallel reduction(&& : finite)
  {
    std::vector<float> row;
    error.guard([&] { row.resize(rows.size); });
#pragma omp for schedule(static)
    for (int r = 0; r < rows.count; ++r) {
      if (row.empty()) continue;
      error.guard([&] {
        const auto index = static_cast<std::size_t>(r);
        file.read_floats(entry, row, index * rows.size);
        if (!scales.empty()) {
          for (float& value : row) value *= scales[index];
        }
        for (const float value : row) finite = finite && std::isfinite(value);
        transpose(row.data(), rows.channels, rows.positions, out.data() + index * rows.size);
      });
    }
  }
  error.rethrow();
  if (!finite) refuse(file.name(), tensor.name, "holds a value that is not finite");
  if (tensor.name.ends_with("running_var")) {
    for (const float value : out.values()) {
      if (value < 0) {
        refuse(file.name(), tensor.name, "holds " + std::to_string(value) + ", expected >= 0");
      }
    }
  }
}

// Hands the rows of a tensor, in the order of the file, to `use`.
template <typename Use>
void for_each_row(const StoredTensor& tensor, Use use) {
  const Rows rows(tensor);
  std::vector<float> row(rows.size);
  for (int r = 0; r < rows.count; ++r) {
    transpose(tensor.value->data() + static_cast<std::size_t>(r) * rows.size, rows.positions,
              rows.channels, row.data());
    use(std::span<const float>(row));
  }
}

float int8_scale(std::span<const float> row) {
  float largest = 0.0F;
  for (const float value : row) largest = std::max(largest, std::abs(value));
  return largest / kInt8Max;
}

template <typename T, typename Convert>
void produce_rows(const StoredTensor& tensor, const io::SafetensorsWriter::Sink& sink,
                  Convert convert) {
  std::vector<T> converted;
  for_each_row(tensor, [&](std::span<const float> row) {
    converted.resize(row.size());
    convert(row, std::span<T>(converted));
    sink(std::as_bytes(std::span<const T>(converted)));
  });
}

void check_storable(const StoredTensor& tensor, Storage storage) {
  const float limit = storage == Storage::float16 && is_weight(tensor)
                          ? 65504.0F
                          : std::numeric_limits<float>::max();
  for (const float value : tensor.value->values()) {
    if (!(std::abs(value) <= limit)) {
      throw std::invalid_argument("tensor " + tensor.name + " holds " + std::to_string(value) +
                                  ", which the file cannot store");
    }
  }
}

void add_weight(io::SafetensorsWriter& writer, const StoredTensor& tensor, Storage storage) {
  switch (storage) {
    case Storage::float32:
      writer.add(tensor.name, io::DType::f32, tensor.file_shape, [tensor](const auto& sink) {
        for_each_row(tensor, [&](std::span<const float> row) { sink(std::as_bytes(row)); });
      });
      return;
    case Storage::float16:
      writer.add(tensor.name, io::DType::f16, tensor.file_shape, [tensor](const auto& sink) {
        produce_rows<std::uint16_t>(tensor, sink, [](auto row, auto out) {
          std::transform(row.begin(), row.end(), out.begin(), io::float_to_half);
        });
      });
      return;
    case Storage::int8:
      writer.add(tensor.name, io::DType::i8, tensor.file_shape, [tensor](const auto& sink) {
        produce_rows<std::int8_t>(tensor, sink, [](auto row, auto out) {
          const float scale = int8_scale(row);
          std::transform(row.begin(), row.end(), out.begin(), [scale](float value) {
            return static_cast<std::int8_t>(scale > 0 ? std::nearbyint(value / scale) : 0.0F);
          });
        });
      });
      writer.add(tensor.name + kScaleSuffix, io::DType::f32, {tensor.file_shape.front()},
                 [tensor](const auto& sink) {
                   for_each_row(tensor, [&](std::span<const float> row) {
                     const float scale = int8_scale(row);
                     sink(std::as_bytes(std::span<const float>(&scale, 1)));
                   });
                 });
      return;
  }
}

}  // namespace

std::vector<StoredTensor> stored_tensors(const EmbeddingNetwork& network) {
  const NetworkDescription& description = network.description();
  const std::vector<nn::Shape> shapes = description.shapes();
  std::vector<StoredTensor> result;
  for (const auto& [layer, parameter, value, learnt] : network.state()) {
    const LayerDescription& of = description.layers[layer];
    StoredTensor tensor{of.tensor_name(parameter), {extent(value->shape().c)}, 1, value, learnt};
    if (has_matrix(of) && parameter == "weight") {
      WeightLayout layout(of, shapes[layer]);
      tensor.file_shape = std::move(layout.shape);
      tensor.positions = layout.positions;
    }
    result.push_back(std::move(tensor));
  }
  return result;
}

Model untrained_model(const NetworkDescription& network, std::uint64_t seed) {
  Model model{ModelMetadata(network), EmbeddingNetwork(network)};
  model.network.initialize(seed);
  return model;
}

Model load_model(const std::filesystem::path& path) { return read_model(io::Safetensors(path)); }

Model read_model(const io::Safetensors& file) {
  const auto text = file.metadata().find(kModelMetadataKey);
  if (text == file.metadata().end()) {
    throw std::invalid_argument(file.name() + ": has no metadata \"" + kModelMetadataKey +
                                "\", expected a model written by sdmt");
  }
  ModelMetadata metadata = parse_model_metadata(text->second, file.name());
  const NetworkDescription network = metadata.network();
  require_weights(file, network);
  Model model{std::move(metadata), EmbeddingNetwork(network), file.name()};
  for (const StoredTensor& tensor : stored_tensors(model.network)) {
    read_tensor(file, tensor, *tensor.value);
  }
  model.network.parameters_changed();
  return model;
}

void add_model(io::SafetensorsWriter& writer, const Model& model, Storage storage) {
  model.metadata.validate();
  if (model.metadata.network() != model.network.description()) {
    throw std::invalid_argument("the metadata describes " + model.metadata.architecture + " for " +
                                std::to_string(model.metadata.preprocessing.height) + " x " +
                                std::to_string(model.metadata.preprocessing.width) +
                                ", which is not the network");
  }
  writer.set_metadata(kModelMetadataKey, to_json(model.metadata));
  for (const StoredTensor& tensor : stored_tensors(model.network)) {
    check_storable(tensor, storage);
    if (is_weight(tensor)) {
      add_weight(writer, tensor, storage);
    } else {
      writer.add(tensor.name, tensor.file_shape, tensor.value->values());
    }
  }
}

void save_model(const std::filesystem::path& path, const Model& model, Storage storage) {
  io::SafetensorsWriter writer;
  add_model(writer, model, storage);
  writer.write(path);
}

void rewrite_metadata(const std::filesystem::path& path, const ModelMetadata& metadata) {
  metadata.validate();
  const io::Safetensors file(path);  // stays open while the new file takes its name
  io::SafetensorsWriter writer;
  for (const auto& [key, text] : file.metadata()) writer.set_metadata(key, text);
  writer.set_metadata(kModelMetadataKey, to_json(metadata));
  for (const io::SafetensorsEntry& entry : file.tensors()) {
    if (entry.dtype == io::DType::unknown) {
      throw std::invalid_argument(path.string() + ": tensor " + entry.name + " has dtype " +
                                  entry.dtype_text + ", which cannot be written again");
    }
    writer.add(entry.name, entry.dtype, entry.shape,
               [&file, &entry](const io::SafetensorsWriter::Sink& sink) {
                 std::vector<std::byte> bytes(entry.size);
                 file.read_bytes(entry, bytes);
                 sink(bytes);
               });
  }
  writer.write(path);
}

std::vector<std::string> load_trunk(const std::filesystem::path& path, EmbeddingNetwork& network) {
  const io::Safetensors file(path);
  std::set<std::string> used;
  std::vector<std::pair<nn::Tensor*, nn::Tensor>> loaded;
  const std::vector<StoredTensor> tensors = stored_tensors(network);
  for (std::size_t i = 0; i < tensors.size(); ++i) {
    if (network.state()[i].layer >= network.description().first_of_head()) break;
    const StoredTensor& tensor = tensors[i];
    used.insert(tensor.name);
    used.insert(tensor.name + kScaleSuffix);
    loaded.emplace_back(tensor.value, nn::Tensor(tensor.value->shape()));
    read_tensor(file, tensor, loaded.back().second);
  }
  for (auto& [value, replacement] : loaded) *value = std::move(replacement);
  network.parameters_changed();

  std::vector<std::string> ignored;
  for (const io::SafetensorsEntry& entry : file.tensors()) {
    if (!used.contains(entry.name)) ignored.push_back(entry.name);
  }
  return ignored;
}

}  // namespace sdmt::reid
