// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/reid/pair_curve.h"

namespace sdmt::tools {

/// A descriptor in a comparison, or the vectors that another network made of the images, and how
/// rows are compared.
struct Contender {
  std::string name;                                   ///< for tables and plots
  std::unique_ptr<image::CropDescriptor> descriptor;  ///< nullptr: the rows come from files
  reid::PairDistance distance;                        ///< empty: Euclidean, of rows of length 1
  std::vector<std::filesystem::path> files;           ///< as reid::image_vectors() takes them
};

/// The embedding of a model.
Contender embedding_contender(reid::Model model);
/// The same network with its head as init-model makes it: what the training adds is the difference.
Contender untrained_head_contender(reid::Model model, std::uint64_t seed);
/// The trunk's feature map, flattened and scaled to length 1: 131,072 values a crop of vgg16.
Contender trunk_contender(reid::Model model);
/// The features and the distance of a pair classifier's file.
Contender pair_classifier_contender(const std::filesystem::path& file);
/// image::ColorHistogramDescriptor.
Contender color_histogram_contender();

}  // namespace sdmt::tools
