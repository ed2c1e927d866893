// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/reid/model_file.h"
#include "sdmt/reid/pair_curve.h"

namespace sdmt::tools {

/// A descriptor in a comparison, and how its rows are compared.
struct Contender {
  std::string name;  ///< for tables and plots
  std::unique_ptr<image::CropDescriptor> descriptor;
  reid::PairDistance distance;  ///< empty: Euclidean, of rows of length 1
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
