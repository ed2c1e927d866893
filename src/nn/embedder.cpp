// SPDX-License-Identifier: Apache-2.0
#include "sdmt/nn/embedder.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace sdmt::nn {

void EmbedderOptions::validate() const {
  if (max_batch < 1 || max_batch > 4096) {
    throw std::invalid_argument("max_batch is " + std::to_string(max_batch) +
                                ", expected 1 to 4096");
  }
}

Embedder::Embedder(Model model, const EmbedderOptions& options)
    : options_(options), model_(std::move(model)) {
  options_.validate();
  model_.metadata.preprocessing.validate();
  const Shape input = model_.network.input_shape(1);
  const Preprocessing& preprocessing = model_.metadata.preprocessing;
  if (preprocessing.height != input.h || preprocessing.width != input.w) {
    throw std::invalid_argument(
        "preprocessing makes patches of " + std::to_string(preprocessing.height) + " x " +
        std::to_string(preprocessing.width) + ", the network takes " + input.str());
  }
}

void Embedder::embed(const ImageView& image, std::span<const PixelRect> rects, EmbeddingRows& out) {
  crops_.clear();
  for (const PixelRect& rect : rects) crops_.push_back({image, rect});
  embed(crops_, out);
}

void Embedder::embed(std::span<const Crop> crops, EmbeddingRows& out) {
  out.values.assign(crops.size() * kEmbeddingSize, 0.0F);
  out.valid.assign(crops.size(), 0);
  visible_.clear();
  for (std::size_t i = 0; i < crops.size(); ++i) {
    const ImageView& image = crops[i].image;
    if (image.empty() || !visible_region(image.width, image.height, crops[i].rect)) continue;
    out.valid[i] = 1;
    visible_.push_back(i);
  }

  // Pieces of nearly equal size: 41 crops as 21 + 20, not as 40 + 1.
  const std::size_t total = visible_.size();
  const auto most = static_cast<std::size_t>(options_.max_batch);
  const std::size_t pieces = (total + most - 1) / most;
  for (std::size_t piece = 0; piece < pieces; ++piece) {
    const std::size_t first = total * piece / pieces;
    const int count = static_cast<int>(total * (piece + 1) / pieces - first);
    patches_.resize(model_.network.input_shape(count));
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < count; ++i) {
      const Crop& crop = crops[visible_[first + static_cast<std::size_t>(i)]];
      extract_patch(crop.image, crop.rect, model_.metadata.preprocessing, patches_.image(i));
    }
    const Tensor& rows = model_.network.forward(patches_, Mode::inference);
    for (int i = 0; i < count; ++i) {
      const std::size_t crop = visible_[first + static_cast<std::size_t>(i)];
      std::copy_n(rows.image(i), kEmbeddingSize, out.values.data() + crop * kEmbeddingSize);
    }
  }
}

}  // namespace sdmt::nn
