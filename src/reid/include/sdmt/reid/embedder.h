// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::reid {

struct EmbedderOptions {
  /// Crops that go through the network at once, 1..4096; more are embedded in pieces of equal size.
  /// Memory grows by about 7 MB a crop (vgg16).
  int max_batch = 40;

  void validate() const;
};

/// Turns boxes of images into unit vectors by an embedding network. One path for tracking,
/// validation and `sdmt embed`. Memory is kept between calls. An embedder serves one thread at a
/// time and uses OpenMP inside; embedders in several threads can share one model:
///
///     Embedder first(load_model(path)), second(first.model());
class Embedder final : public image::CropDescriptor {
 public:
  /// Throws std::invalid_argument when the options or the model's preprocessing are not valid.
  explicit Embedder(Model model, const EmbedderOptions& options = {});
  /// Throws also when the model is null.
  explicit Embedder(std::shared_ptr<const Model> model, const EmbedderOptions& options = {});

  /// For more embedders on the same weights. What only training needs has been given up, see
  /// EmbeddingNetwork::release_for_inference(), when the model was given by value.
  const std::shared_ptr<const Model>& model() const { return model_; }
  const ModelMetadata& metadata() const { return model_->metadata; }
  std::string name() const override { return "embedding"; }
  int dimension() const override { return model_->network.embedding_size(); }
  /// The threshold that validation stored in the model file.
  std::optional<double> tau_a() const override;
  /// Throws std::runtime_error naming the model when an embedding is not of length 1: hostile
  /// weights can make NaN or nothing but zeros.
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override;
  /// Much quicker than describe() of overlapping windows when the network's trunk keeps positions,
  /// as padded convolutions do, and makes a map of 32 x 16: it runs once over the region that all
  /// windows cover, and the head on windows of its map.
  /// Along its edges a window then sees the image around it, where a crop sees zeros. Throws
  /// std::invalid_argument when a shifted window leaves the image.
  void describe_shifted(const image::ImageView& image, const image::PixelRect& window,
                        std::span<const image::GridShift> shifts,
                        image::DescriptorRows& out) override;

 private:
  EmbedderOptions options_;
  std::shared_ptr<const Model> model_;
  EmbeddingNetwork::Workspace workspace_;
  int cell_ = 0;  // input pixels to a position of the map, 0: it has no windows
  nn::Tensor patches_;
  nn::Tensor windows_;                // of the feature map
  std::vector<std::size_t> visible_;  // positions of the valid crops of a call
};

}  // namespace sdmt::reid
