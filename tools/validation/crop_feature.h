// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sdmt/reid/embedder.h"
#include "sdmt/reid/labelled_embeddings.h"
#include "sdmt/reid/pair_curve.h"
#include "validation/validation_crops.h"

namespace sdmt::tools {

/// A way to describe a crop by a vector, of length 1 unless it has a distance of its own.
class CropFeature {
 public:
  virtual ~CropFeature() = default;
  /// For tables and plots.
  virtual std::string name() const = 0;
  virtual int dimensions() const = 0;
  /// One row of dimensions() values a crop. Every crop has a visible region.
  virtual void compute(std::span<const reid::Crop> crops, float* rows) = 0;
  /// How rows are compared; empty: Euclidean.
  virtual reid::PairDistance distance() const { return {}; }
};

/// The embedding of a model.
std::unique_ptr<CropFeature> embedding_feature(reid::Model model);
/// The same network with its head as init-model makes it: what the training adds is the difference.
std::unique_ptr<CropFeature> untrained_head_feature(reid::Model model, std::uint64_t seed);
/// The trunk's feature map, flattened and scaled to length 1: 131,072 values a crop.
std::unique_ptr<CropFeature> trunk_feature(reid::Model model);
/// The features and the distance of a pair classifier's file.
std::unique_ptr<CropFeature> pair_classifier_feature(const std::filesystem::path& file);
/// image::color_histogram().
std::unique_ptr<CropFeature> color_histogram_feature();

/// Crops and their rows for one feature.
struct DescribedCrops {
  std::vector<ValidationCrop> crops;
  std::vector<reid::LabelledEmbeddings> features;  ///< in the order of the features
  std::vector<std::filesystem::path> unreadable;   ///< images left out
};

/// Decodes the images (all threads, a batch at a time) and computes every feature. Images that
/// cannot be read and boxes too small to see are left out; more than 1 % of them is
/// std::invalid_argument. `progress` gets the crops done.
DescribedCrops describe_crops(const std::vector<ValidationCrop>& crops,
                              std::span<const std::unique_ptr<CropFeature>> features,
                              const std::function<void(std::int64_t)>& progress);

}  // namespace sdmt::tools
