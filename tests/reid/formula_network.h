// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sdmt/image/patch.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::reid::testing_support {

// The weights and pictures of tests/parity/parity_network.py, computed by the same formula.

inline constexpr int kFormulaCrops = 16;

// `count` numbers in [0, 1), multiples of 2^-24.
inline std::vector<float> hashed(std::size_t count, std::uint32_t stream) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t x = static_cast<std::uint32_t>(i) + stream * 0x9E3779B9U;
    x ^= x >> 16;
    x *= 0x7FEB352DU;
    x ^= x >> 15;
    x *= 0x846CA68BU;
    x ^= x >> 16;
    values[i] = static_cast<float>(x >> 8) * 0x1p-24F;
  }
  return values;
}

inline std::vector<float> uniform(std::size_t count, std::uint32_t stream, float low, float high) {
  std::vector<float> values = hashed(count, stream);
  for (float& value : values) value = low + (high - low) * value;
  return values;
}

// A picture of random patches with noise, 8-bit BGR without padding.
struct FormulaCrop {
  explicit FormulaCrop(int i) : height(40 + 17 * i), width(20 + 9 * i) {
    const auto rows = static_cast<std::size_t>(height);
    const auto columns = static_cast<std::size_t>(width);
    const std::size_t block_columns = (columns + 7) / 8;
    const auto stream = static_cast<std::uint32_t>(1000 + 2 * i);
    const auto blocks = hashed((rows + 7) / 8 * block_columns * 3, stream);
    const auto noise = hashed(rows * columns * 3, stream + 1);
    for (std::size_t y = 0; y < rows; ++y) {
      for (std::size_t x = 0; x < columns; ++x) {
        for (std::size_t c = 0; c < 3; ++c) {
          pixels.push_back(
              static_cast<std::uint8_t>(blocks[(y / 8 * block_columns + x / 8) * 3 + c] * 192.0F +
                                        noise[(y * columns + x) * 3 + c] * 63.0F));
        }
      }
    }
  }
  image::ImageView view() const {
    return {pixels.data(), width, height, width * 3, image::ChannelOrder::bgr};
  }
  image::PixelRect rect() const { return {0, 0, 1.0 * width, 1.0 * height}; }

  int height;
  int width;
  std::vector<std::uint8_t> pixels;
};

// Writes the model file, values in the order of the file (which is PyTorch's).
inline void write_formula_model(const std::filesystem::path& path) {
  const EmbeddingNetwork network;  // for the names and shapes
  io::SafetensorsWriter writer;
  writer.set_metadata(kModelMetadataKey, to_json(ModelMetadata{}));
  std::uint32_t stream = 0;
  for (const auto& tensor : stored_tensors(network)) {
    ++stream;
    float low = -0.1F;
    float high = 0.1F;
    if (tensor.file_shape.size() > 1) {
      std::uint64_t inputs = 1;
      for (std::size_t i = 1; i < tensor.file_shape.size(); ++i) inputs *= tensor.file_shape[i];
      high = static_cast<float>(std::sqrt(6.0 / static_cast<double>(inputs)));
      low = -high;
    } else if (tensor.name == "head.bn.weight" || tensor.name == "head.bn.running_var") {
      low = 0.5F;
      high = 1.5F;
    } else if (tensor.name.starts_with("head.bn.")) {
      low = -0.5F;
      high = 0.5F;
    }
    const std::size_t count = tensor.value->size();
    writer.add(tensor.name, io::DType::f32, tensor.file_shape, [=](const auto& sink) {
      const auto values = uniform(count, stream, low, high);
      sink(std::as_bytes(std::span<const float>(values)));
    });
  }
  writer.write(path);
}

}  // namespace sdmt::reid::testing_support
