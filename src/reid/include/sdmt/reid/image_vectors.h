// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include "sdmt/nn/tensor.h"

namespace sdmt::reid {

/// The rows of the embedding files (read_embedding_file()), all of one dimension, that belong
/// to the images at `paths`, in their order. A path belongs to the folder of its data set,
/// `roots[i]`, and is known by that folder's name and what follows,
/// "cuhk03/bounding_box_train/0001_c1s1_000000_00.jpg": a row is its own when its name, made
/// absolute, ends in that. Throws std::invalid_argument naming the first image without a row or
/// with two, and images of two folders that are known by one name.
nn::Tensor image_vectors(std::span<const std::filesystem::path> files,
                         std::span<const std::filesystem::path> paths,
                         std::span<const std::filesystem::path> roots);

}  // namespace sdmt::reid
