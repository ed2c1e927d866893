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
#include "sdmt/nn/batch_shards.h"
#include "sdmt/train/configuration.h"
#include "sdmt/train/trainer_options.h"
#include "sdmt/train/training_set.h"
#include "source_images.h"
#include "trained_network.h"

namespace sdmt::train {

// What the trained layers are given: results of the frozen layers for views of the images, cached
// or computed anew for every batch; the patches themselves where no layer is frozen.
class FrozenFeatures {
 public:
  // All of them must outlive this object, which reads the images that others have read when it
  // needs them.
  FrozenFeatures(TrainedNetwork& network, TrainingSet& data, const TrainerOptions& options,
                 const image::Preprocessing& preprocessing, nn::ProcessGroup& group);

  // See front_configuration().
  const Configuration& configuration() const { return configuration_; }
  // As Trainer::cache_bytes() and Trainer::prepare().
  std::size_t cache_bytes() const;
  void prepare(const CacheProgress& progress, const std::filesystem::path& cache_file);

  // The features of those of a batch of training images that are here, each seen in one way.
  void of_batch(std::span<const int> images, std::int64_t iteration, const nn::BatchShards& shards,
                nn::Tensor& features);
  // The same, by a random view of each image of the batch that is cached.
  void of_cached_views(std::span<const int> images, nn::Random& random,
                       const nn::BatchShards& shards, nn::Tensor& features) const;
  // Images of a validation set, as they are.
  void of_validation(std::size_t set, int first, int count, nn::Tensor& features);

 private:
  FeatureCache::Source source(SourceImages& images, int views) const;

  TrainedNetwork& network_;
  SourceImages images_;
  std::vector<SourceImages> validation_images_;
  const TrainerOptions& options_;
  const image::Preprocessing& preprocessing_;
  nn::ProcessGroup& group_;
  Configuration configuration_;
  int views_;  // 0: no cache
  std::optional<FeatureCache> cache_;
  std::vector<FeatureCache> validation_caches_;
  nn::Tensor patches_;
};

}  // namespace sdmt::train
