// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "sdmt/nn/embedder.h"
#include "sdmt/track/appearance_model.h"

namespace sdmt::track {

/// Appearance by the deep similarity metric (section III-B of the paper).
class EmbeddingAppearance final : public AppearanceModel {
 public:
  /// Throws as nn::Embedder.
  explicit EmbeddingAppearance(nn::Model model, const nn::EmbedderOptions& options = {});

  int dimension() const override;
  /// The threshold that validation stored in the model file.
  double affinity_threshold() const override;
  void embed(const nn::ImageView& frame, std::span<const Tlwh> boxes, Embeddings& out) override;
  /// The convolutions run once for all boxes, see nn::Embedder::embed_windows(), when the network's
  /// input is 128 x 64.
  void embed_shifted(const nn::ImageView& frame, const Tlwh& box, std::span<const BoxShift> shifts,
                     Embeddings& out) override;

 private:
  void take_rows(Embeddings& out);

  nn::Embedder embedder_;
  std::vector<nn::PixelRect> rects_;
  std::vector<nn::WindowShift> shifts_;
  nn::EmbeddingRows rows_;
};

}  // namespace sdmt::track
