// SPDX-License-Identifier: Apache-2.0
#include "frozen_features.h"

#include "random_stream.h"
#include "sdmt/io/first_error.h"
#include "training_configuration.h"

namespace sdmt::train {

FrozenFeatures::FrozenFeatures(TrainedNetwork& network, const TrainingSet& data,
                               const TrainerOptions& options,
                               const image::Preprocessing& preprocessing)
    : network_(network),
      data_(data),
      options_(options),
      preprocessing_(preprocessing),
      configuration_(front_configuration(options, data, network)),
      views_(network.has_front() ? options.views : 0) {}

FeatureCache::Source FrozenFeatures::source(std::span<const image::Image> images, int views) const {
  return {images, views, options_.augmentation, options_.seed, preprocessing_};
}

std::size_t FrozenFeatures::cache_bytes() const {
  return views_ == 0 ? 0 : FeatureCache::bytes(network_, source(data_.images, views_));
}

void FrozenFeatures::prepare(const CacheProgress& progress,
                             const std::filesystem::path& cache_file) {
  if (!network_.has_front()) return;
  const bool stored = !cache_file.empty() && std::filesystem::exists(cache_file);
  std::int64_t total = stored ? 0 : static_cast<std::int64_t>(data_.images.size()) * views_;
  for (const auto& set : data_.validation) total += static_cast<std::int64_t>(set.images.size());
  std::int64_t before = 0;
  const CacheProgress report = [&](std::int64_t done, std::int64_t) {
    if (progress) progress(before + done, total);
  };
  for (const auto& set : data_.validation) {
    validation_caches_.emplace_back(network_, source(set.images, 1), report);
    before += static_cast<std::int64_t>(set.images.size());
  }
  if (views_ == 0) return;
  cache_.emplace(network_, source(data_.images, views_), report, cache_file, configuration_);
}

void FrozenFeatures::of_batch(std::span<const int> images, std::int64_t iteration,
                              nn::Tensor& features) {
  if (cache_) {
    auto random = random_stream(options_.seed, Purpose::augmentation, 0,
                                static_cast<std::uint64_t>(iteration));
    return of_cached_views(images, random, features);
  }
  make_batch_patches(data_.images, images, iteration, options_.augmentation, options_.seed,
                     preprocessing_, patches_);
  features = network_.run_front(patches_);
}

void FrozenFeatures::of_cached_views(std::span<const int> images, nn::Random& random,
                                     nn::Tensor& features) const {
  std::vector<View> views;
  views.reserve(images.size());
  for (const int image : images) {
    const auto view = random.below(static_cast<std::uint64_t>(views_));
    views.push_back({image, static_cast<int>(view)});
  }
  const int count = static_cast<int>(views.size());
  features.resize(network_.front_shape(count));
  io::FirstError error;
#pragma omp parallel for schedule(static)
  for (int i = 0; i < count; ++i) {
    error.guard([&] { cache_->read(views[i], features.image(i)); });
  }
  error.rethrow();
}

void FrozenFeatures::of_validation(std::size_t set, int first, int count,
                                   nn::Tensor& features) const {
  if (network_.has_front()) {
    features.resize(network_.front_shape(count));
    for (int i = 0; i < count; ++i) {
      validation_caches_[set].read({first + i, 0}, features.image(i));
    }
    return;
  }
  std::vector<View> views;
  views.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) views.push_back({first + i, 0});
  make_view_patches(data_.validation[set].images, views, options_.augmentation, options_.seed,
                    preprocessing_, features);
}

}  // namespace sdmt::train
