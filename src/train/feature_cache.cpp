// SPDX-License-Identifier: Apache-2.0
#include "feature_cache.h"

#include <algorithm>
#include <cstring>

#include "sdmt/io/half.h"
#include "shared_blocks.h"

namespace sdmt::train {

namespace {

constexpr const char* kTensor = "features";
using Sink = std::function<void(std::span<const std::uint16_t>)>;

// The views, as halves to `out`.
void compute_block(TrainedNetwork& network, const FeatureCache::Source& source, int view,
                   std::int64_t first, std::int64_t end, nn::Tensor& patches, std::uint16_t* out) {
  if (first == end) return;
  std::vector<int> images;
  std::vector<View> views;
  for (std::int64_t i = first; i < end; ++i) {
    images.push_back(static_cast<int>(i));
    views.push_back({static_cast<int>(i), view});
  }
  make_view_patches(source.images.with(images), views, source.augmentation, source.seed,
                    source.preprocessing, patches);
  const nn::Tensor& features = network.run_front(patches);
  const auto count = static_cast<std::ptrdiff_t>(features.size());
  // nothing throws
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    out[i] = io::float_to_half(features.data()[i]);
  }
}

// All views of all images, view after view, handed to the sink in pieces.
void compute(TrainedNetwork& network, const FeatureCache::Source& source, nn::ProcessGroup& group,
             const CacheProgress& progress, const Sink& sink) {
  const auto images = static_cast<std::int64_t>(source.images.size());
  const std::size_t values = network.front_shape(1).size();
  nn::Tensor patches;
  std::vector<std::uint16_t> halves;  // of a round
  for (int view = 0; view < source.views; ++view) {
    for_shared_blocks(
        images, group,
        [&](std::int64_t first, std::int64_t end) {
          const std::int64_t blocks = group.rank() * kBlock;
          halves.resize(static_cast<std::size_t>(kBlock * group.size()) * values);
          compute_block(network, source, view, first, end, patches,
                        halves.data() + blocks * static_cast<std::ptrdiff_t>(values));
        },
        [&](const std::vector<std::int64_t>& bounds) {
          halves.resize(static_cast<std::size_t>(bounds.back() - bounds.front()) * values);
          group.gather(std::as_writable_bytes(std::span(halves)),
                       byte_bounds(bounds, values * sizeof(std::uint16_t)));
          sink(halves);
          if (progress) progress(view * images + bounds.back(), images * source.views);
        });
  }
}

}  // namespace

FeatureCache::FeatureCache(TrainedNetwork& network, const Source& source, nn::ProcessGroup& group,
                           const CacheProgress& progress, const std::filesystem::path& path,
                           const Configuration& configuration)
    : values_(network.front_shape(1).size()), images_(source.images.size()) {
  if (path.empty()) {
    memory_.reserve(bytes(network, images_, source.views) / sizeof(std::uint16_t));
    compute(network, source, group, progress, [this](std::span<const std::uint16_t> piece) {
      memory_.insert(memory_.end(), piece.begin(), piece.end());
    });
    return;
  }
  const std::vector<std::uint64_t> shape = {static_cast<std::uint64_t>(source.views), images_,
                                            values_};
  std::byte exists{std::filesystem::exists(path)};
  group.broadcast({&exists, 1});
  if (exists == std::byte{0} && group.rank() > 0) {
    compute(network, source, group, progress, [](std::span<const std::uint16_t>) {});
  } else if (exists == std::byte{0}) {
    io::SafetensorsWriter writer;
    for (const auto& [key, value] : configuration) writer.set_metadata(key, value);
    writer.add(kTensor, io::DType::f16, shape, [&](const io::SafetensorsWriter::Sink& sink) {
      compute(network, source, group, progress,
              [&sink](std::span<const std::uint16_t> piece) { sink(std::as_bytes(piece)); });
    });
    writer.write(path);
  }
  group.broadcast({&exists, 1});  // the file is there
  file_.emplace(path);
  require_same_configuration(path.string(), file_->metadata(), configuration);
  stored_ = &file_->at(kTensor, shape);
}

std::size_t FeatureCache::bytes(TrainedNetwork& network, std::size_t images, int views) {
  return network.front_shape(1).size() * images * static_cast<std::size_t>(views) *
         sizeof(std::uint16_t);
}

void FeatureCache::read(View view, float* out) const {
  const std::size_t row =
      static_cast<std::size_t>(view.number) * images_ + static_cast<std::size_t>(view.image);
  if (file_) return file_->read_floats(*stored_, {out, values_}, row * values_);
  std::transform(memory_.begin() + row * values_, memory_.begin() + (row + 1) * values_, out,
                 io::half_to_float);
}

}  // namespace sdmt::train
