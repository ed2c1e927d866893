// SPDX-License-Identifier: Apache-2.0
#include "frozen_features.h"

#include "random_stream.h"
#include "sdmt/io/first_error.h"
#include "training_configuration.h"

namespace sdmt::train {

FrozenFeatures::FrozenFeatures(TrainedNetwork& network, TrainingSet& data,
                               const TrainerOptions& options,
                               const image::Preprocessing& preprocessing, nn::ProcessGroup& group)
    : network_(network),
      images_(data.images, data.files),
      options_(options),
      preprocessing_(preprocessing),
      group_(group),
      configuration_(front_configuration(options, data, network)),
      views_(network.has_front() ? options.views : 0) {
  for (ValidationSet& set : data.validation) validation_images_.emplace_back(set.images, set.files);
}

FeatureCache::Source FrozenFeatures::source(SourceImages& images, int views) const {
  return {images, views, options_.augmentation, options_.seed, preprocessing_};
}

std::size_t FrozenFeatures::cache_bytes() const {
  return FeatureCache::bytes(network_, images_.size(), views_);
}

void FrozenFeatures::prepare(const CacheProgress& progress,
                             const std::filesystem::path& cache_file) {
  if (!network_.has_front()) return;
  const bool stored = !cache_file.empty() && std::filesystem::exists(cache_file);
  std::int64_t total = stored ? 0 : static_cast<std::int64_t>(images_.size()) * views_;
  for (const auto& set : validation_images_) total += static_cast<std::int64_t>(set.size());
  std::int64_t before = 0;
  const CacheProgress report = [&](std::int64_t done, std::int64_t) {
    if (progress) progress(before + done, total);
  };
  for (auto& set : validation_images_) {
    validation_caches_.emplace_back(network_, source(set, 1), group_, report);
    before += static_cast<std::int64_t>(set.size());
  }
  if (views_ == 0) return;
  cache_.emplace(network_, source(images_, views_), group_, report, cache_file, configuration_);
}

void FrozenFeatures::of_batch(std::span<const int> images, std::int64_t iteration,
                              const nn::BatchShards& shards, nn::Tensor& features) {
  if (cache_) {
    auto random = random_stream(options_.seed, Purpose::augmentation, 0,
                                static_cast<std::uint64_t>(iteration));
    return of_cached_views(images, random, shards, features);
  }
  const int first = shards.begin(shards.first());
  const auto here = images.subspan(static_cast<std::size_t>(first),
                                   static_cast<std::size_t>(shards.images_here()));
  make_batch_patches(images_.with(here), here, static_cast<std::size_t>(first), iteration,
                     options_.augmentation, options_.seed, preprocessing_,
                     network_.has_front() ? patches_ : features);
  if (network_.has_front()) features = network_.run_front(patches_);
}

void FrozenFeatures::of_cached_views(std::span<const int> images, nn::Random& random,
                                     const nn::BatchShards& shards, nn::Tensor& features) const {
  std::vector<View> views;
  views.reserve(images.size());
  for (const int image : images) {
    const auto view = random.below(static_cast<std::uint64_t>(views_));
    views.push_back({image, static_cast<int>(view)});
  }
  const int first = shards.begin(shards.first()), count = shards.images_here();
  features.resize(network_.front_shape(count));
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    error.guard([&] { cache_->read(views[first + i], features.image(i)); });
  }
  error.rethrow();
}

void FrozenFeatures::of_validation(std::size_t set, int first, int count, nn::Tensor& features) {
  if (network_.has_front()) {
    features.resize(network_.front_shape(count));
    for (int i = 0; i < count; ++i) {
      validation_caches_[set].read({first + i, 0}, features.image(i));
    }
    return;
  }
  std::vector<int> images;
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    images.push_back(first + i);
    views.push_back({first + i, 0});
  }
  make_view_patches(validation_images_[set].with(images), views, options_.augmentation,
                    options_.seed, preprocessing_, features);
}

}  // namespace sdmt::train
