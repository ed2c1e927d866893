// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/image/patch.h"
#include "sdmt/reid/model_file.h"

namespace sdmt::reid {

struct EmbedderOptions {
  /// Crops that go through the network at once, 1..4096; more are embedded in pieces of equal size.
  /// Memory grows by about 7 MB a crop (vgg16).
  int max_batch = 40;

  void validate() const;
};

/// A box of an image whose appearance is wanted.
struct Crop {
  image::ImageView image;
  image::PixelRect rect;
};

/// Where a window lies in a grid, in cells to the right of and below its middle. A cell is one
/// position of vgg16's feature map: 1/16 of the window's width, 1/32 of its height.
struct WindowShift {
  static constexpr int kColumns = 16;  ///< cells across a window
  static constexpr int kRows = 32;     ///< cells down a window

  int columns = 0;
  int rows = 0;
};

/// Feature vectors of crops, row after row.
struct EmbeddingRows {
  std::vector<float> values;         ///< [crops, Embedder::dimension()]; zeros where not valid
  std::vector<unsigned char> valid;  ///< [crops]; 0 where the crop has no visible_region()
};

/// Turns boxes of images into unit vectors whose Euclidean distance says how unlike two people
/// look. One path for tracking, validation and `sdmt embed`. Memory is kept between calls. Not
/// thread-safe; uses OpenMP inside. A row does not depend on the other crops of the call.
class Embedder {
 public:
  /// Throws std::invalid_argument when the options or the model's preprocessing are not valid.
  explicit Embedder(Model model, const EmbedderOptions& options = {});

  const ModelMetadata& metadata() const { return model_.metadata; }
  /// Values of a row.
  std::size_t dimension() const {
    return static_cast<std::size_t>(model_.network.embedding_size());
  }

  /// One row for each crop, in order. `out` is resized.
  void embed(std::span<const Crop> crops, EmbeddingRows& out);
  /// The same for boxes of one image.
  void embed(const image::ImageView& image, std::span<const image::PixelRect> rects,
             EmbeddingRows& out);

  /// Whether embed_windows() can be used: the trunk of the network is one that keeps positions, as
  /// padded convolutions do, and makes a map of 32 x 16.
  bool reads_windows() const { return cell_ > 0; }
  /// One row for each shift of `window`, much quicker than embed() of them when they overlap: the
  /// convolutions run once over the region that all of them cover, and the fully connected layers
  /// on windows of its feature map. What differs from embed(): along its edges a window sees the
  /// image around it, where a crop sees zeros. Throws std::invalid_argument when a shifted window
  /// leaves the image or reads_windows() is false.
  void embed_windows(const image::ImageView& image, const image::PixelRect& window,
                     std::span<const WindowShift> shifts, EmbeddingRows& out);

 private:
  EmbedderOptions options_;
  Model model_;
  int cell_ = 0;  // input pixels to a position of the map, 0: no windows
  nn::Tensor patches_;
  nn::Tensor windows_;                // of the feature map
  std::vector<Crop> crops_;           // of one image
  std::vector<std::size_t> visible_;  // positions of the valid crops of a call
};

}  // namespace sdmt::reid
