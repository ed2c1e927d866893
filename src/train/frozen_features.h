// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "feature_cache.h"
#include "patches.h"
#include "sdmt/image/preprocessing.h"
#include "sdmt/train/configuration.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"
#include "trained_network.h"

namespace sdmt::train {

// What the trained layers are given: results of the frozen layers for views of the images, cached
// or computed anew for every batch; the patches themselves where no layer is frozen.
class FrozenFeatures {
 public:
  // All of them must outlive this object.
  FrozenFeatures(TrainedNetwork& network, const TrainingSet& data, const TrainerOptions& options,
                 const image::Preprocessing& preprocessing);

  // See front_configuration().
  const Configuration& configuration() const { return configuration_; }
  // As Trainer::cache_bytes() and Trainer::prepare().
  std::size_t cache_bytes() const;
  void prepare(const CacheProgress& progress, const std::filesystem::path& cache_file);

  // The features of one batch of training images, each seen in one way.
  void of_batch(std::span<const int> images, std::int64_t iteration, nn::Tensor& features);
  // The same, by a random view of each image that is cached.
  void of_cached_views(std::span<const int> images, nn::Random& random, nn::Tensor& features) const;
  // Images of a validation set, as they are.
  void of_validation(std::size_t set, int first, int count, nn::Tensor& features) const;

 private:
  FeatureCache::Source source(std::span<const image::Image> images, int views) const;

  TrainedNetwork& network_;
  const TrainingSet& data_;
  const TrainerOptions& options_;
  const image::Preprocessing& preprocessing_;
  Configuration configuration_;
  int views_;  // 0: no cache
  std::optional<FeatureCache> cache_;
  std::vector<FeatureCache> validation_caches_;
  nn::Tensor patches_;
};

}  // namespace sdmt::train
