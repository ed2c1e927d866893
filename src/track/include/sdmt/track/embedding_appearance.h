// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/reid/embedder.h"
#include "sdmt/track/appearance_model.h"

namespace sdmt::track {

/// Appearance by the deep similarity metric (section III-B of the paper).
class EmbeddingAppearance final : public AppearanceModel {
 public:
  /// Throws as reid::Embedder.
  explicit EmbeddingAppearance(reid::Model model, const reid::EmbedderOptions& options = {});

  int dimension() const override;
  /// The threshold that validation stored in the model file.
  double affinity_threshold() const override;
  void embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
             Embeddings& out) override;
  /// The convolutions run once for all boxes where reid::Embedder::reads_windows().
  void embed_shifted(const image::ImageView& frame, const mot::Tlwh& box,
                     std::span<const BoxShift> shifts, Embeddings& out) override;

 private:
  void take_rows(Embeddings& out);

  reid::Embedder embedder_;
  std::vector<image::PixelRect> rects_;
  std::vector<reid::WindowShift> shifts_;
  reid::EmbeddingRows rows_;
};

}  // namespace sdmt::track
