// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "sdmt/reid/labelled_embeddings.h"
#include "validation/contender.h"
#include "validation/validation_crops.h"

namespace sdmt::tools {

/// Crops and the rows that each contender made of them.
struct DescribedCrops {
  std::vector<ValidationCrop> crops;
  std::vector<reid::LabelledEmbeddings> rows;     ///< in the order of the contenders
  std::vector<std::filesystem::path> unreadable;  ///< images left out
};

/// Decodes the images (all threads, a batch at a time) and lets every contender describe the crops.
/// Vectors of a contender's files are taken as they are, of boxes of a sequence there are none.
/// Images that cannot be read and boxes too small to see are left out; more than 1 % of them is
/// std::invalid_argument, and what reid::image_vectors() throws. `progress` gets the crops done.
DescribedCrops describe_crops(const std::vector<ValidationCrop>& crops,
                              std::span<const Contender> contenders,
                              const std::function<void(std::int64_t)>& progress);

}  // namespace sdmt::tools
