// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sdmt/nn/tensor.h"

namespace sdmt::reid {

/// Feature vectors of images, as `sdmt embed` writes them; those of another network may be written
/// the same way.
struct EmbeddingFile {
  std::vector<std::string> images;  ///< name of the image of each row, as it was given
  nn::Tensor rows;                  ///< [images, 1, 1, dimensions], each scaled to length 1
};

/// Reads a safetensors file with a tensor `embeddings` [images, dimensions] (F32, F16, BF16 or
/// F64) and the metadata `images`, a JSON array of as many names. Throws std::invalid_argument
/// naming the file and what is wrong: a tensor or the names missing, their numbers different, a
/// vector that is not finite or 0.
EmbeddingFile read_embedding_file(const std::filesystem::path& path);

}  // namespace sdmt::reid
