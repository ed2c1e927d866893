// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/embedding_appearance.h"

#include <utility>

namespace sdmt::track {

EmbeddingAppearance::EmbeddingAppearance(nn::Model model, const nn::EmbedderOptions& options)
    : embedder_(std::move(model), options) {}

int EmbeddingAppearance::dimension() const { return nn::kEmbeddingSize; }

double EmbeddingAppearance::affinity_threshold() const {
  return embedder_.metadata().tau_a.value_or(nn::AffinityThreshold{}).value;
}

void EmbeddingAppearance::embed(const nn::ImageView& frame, std::span<const Tlwh> boxes,
                                Embeddings& out) {
  rects_.clear();
  for (const Tlwh& box : boxes) {
    rects_.push_back({box.left - 1, box.top - 1, box.width, box.height});
  }
  embedder_.embed(frame, rects_, rows_);
  out.dimension = nn::kEmbeddingSize;
  out.values.swap(rows_.values);
  out.valid.swap(rows_.valid);
}

}  // namespace sdmt::track
