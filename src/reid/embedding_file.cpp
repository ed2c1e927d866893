// SPDX-License-Identifier: Apache-2.0
#include "sdmt/reid/embedding_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "sdmt/io/safetensors.h"

namespace sdmt::reid {

namespace {

std::vector<std::string> names(const io::Safetensors& file) {
  const auto found = file.metadata().find("images");
  if (found != file.metadata().end()) {
    try {
      return nlohmann::json::parse(found->second).get<std::vector<std::string>>();
    } catch (const nlohmann::json::exception&) {
      // said below, as when it is missing
    }
  }
  throw std::invalid_argument(file.name() +
                              ": expected the metadata `images`, a JSON array of the images' "
                              "names, as `sdmt embed` writes it");
}

void normalize(std::span<float> row, const std::string& file, const std::string& image) {
  double square = 0;
  for (const float value : row) square += static_cast<double>(value) * value;
  if (!std::isfinite(square) || square == 0) {
    throw std::invalid_argument(file + ": the vector of " + image + " is " +
                                (square == 0 ? "0" : "not finite"));
  }
  const double scale = 1 / std::sqrt(square);
  for (float& value : row) value = static_cast<float>(value * scale);
}

}  // namespace

EmbeddingFile read_embedding_file(const std::filesystem::path& path) {
  const io::Safetensors file(path);
  const auto& entry = file.at("embeddings");
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  if (entry.shape.size() != 2 || entry.shape[0] > kMost || entry.shape[1] > kMost ||
      entry.count() == 0) {
    throw std::invalid_argument(file.name() + ": embeddings is " + entry.shape_str() +
                                ", expected [images,dimensions]");
  }
  EmbeddingFile result;
  result.images = names(file);
  if (result.images.size() != entry.shape[0]) {
    throw std::invalid_argument(file.name() + ": embeddings has " + std::to_string(entry.shape[0]) +
                                " rows, but `images` names " +
                                std::to_string(result.images.size()));
  }
  const int count = static_cast<int>(entry.shape[0]);
  const int dimensions = static_cast<int>(entry.shape[1]);
  result.rows.resize({count, 1, 1, dimensions});
  file.read_floats(entry, result.rows.values());
  for (int i = 0; i < count; ++i) {
    normalize({result.rows.image(i), entry.shape[1]}, file.name(), result.images[i]);
  }
  return result;
}

}  // namespace sdmt::reid
