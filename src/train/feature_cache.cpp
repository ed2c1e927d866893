// SPDX-License-Identifier: Apache-2.0
#include "feature_cache.h"

#include <algorithm>
#include <cstring>

#include "sdmt/io/half.h"

namespace sdmt::train {

namespace {

constexpr const char* kTensor = "features";
constexpr int kBatch = 32;

using Sink = std::function<void(std::span<const std::uint16_t>)>;

// All views of all images, view after view, handed to the sink in pieces.
void compute(TrainedNetwork& network, const FeatureCache::Source& source,
             const CacheProgress& progress, const Sink& sink) {
  const auto images = static_cast<std::int64_t>(source.images.size());
  const std::int64_t total = images * source.views;
  nn::Tensor patches;
  std::vector<std::uint16_t> halves;
  for (std::int64_t first = 0; first < total; first += kBatch) {
    std::vector<View> views;
    for (std::int64_t i = first; i < std::min(total, first + kBatch); ++i) {
      views.push_back({static_cast<int>(i % images), static_cast<int>(i / images)});
    }
    make_view_patches(source.images, views, source.augmentation, source.seed, source.preprocessing,
                      patches);
    const nn::Tensor& features = network.run_front(patches);
    halves.resize(features.size());
    const auto count = static_cast<std::ptrdiff_t>(features.size());
    // nothing throws
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      halves[i] = io::float_to_half(features.data()[i]);
    }
    sink(halves);
    if (progress) progress(first + static_cast<std::int64_t>(views.size()), total);
  }
}

}  // namespace

FeatureCache::FeatureCache(TrainedNetwork& network, const Source& source,
                           const CacheProgress& progress, const std::filesystem::path& path,
                           const Configuration& configuration)
    : values_(network.front_shape(1).size()), images_(source.images.size()) {
  if (path.empty()) {
    memory_.reserve(bytes(network, source) / sizeof(std::uint16_t));
    compute(network, source, progress, [this](std::span<const std::uint16_t> piece) {
      memory_.insert(memory_.end(), piece.begin(), piece.end());
    });
    return;
  }
  const std::vector<std::uint64_t> shape = {static_cast<std::uint64_t>(source.views), images_,
                                            values_};
  if (!std::filesystem::exists(path)) {
    io::SafetensorsWriter writer;
    for (const auto& [key, value] : configuration) writer.set_metadata(key, value);
    writer.add(kTensor, io::DType::f16, shape, [&](const io::SafetensorsWriter::Sink& sink) {
      compute(network, source, progress,
              [&sink](std::span<const std::uint16_t> piece) { sink(std::as_bytes(piece)); });
    });
    writer.write(path);
  }
  file_.emplace(path);
  require_same_configuration(path.string(), file_->metadata(), configuration);
  stored_ = &file_->at(kTensor, shape);
}

std::size_t FeatureCache::bytes(TrainedNetwork& network, const Source& source) {
  return network.front_shape(1).size() * source.images.size() *
         static_cast<std::size_t>(source.views) * sizeof(std::uint16_t);
}

void FeatureCache::read(View view, float* out) const {
  const std::size_t row =
      static_cast<std::size_t>(view.number) * images_ + static_cast<std::size_t>(view.image);
  if (file_) return file_->read_floats(*stored_, {out, values_}, row * values_);
  std::transform(memory_.begin() + row * values_, memory_.begin() + (row + 1) * values_, out,
                 io::half_to_float);
}

}  // namespace sdmt::train
