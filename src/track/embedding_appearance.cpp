// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/embedding_appearance.h"

#include <utility>

namespace sdmt::track {

EmbeddingAppearance::EmbeddingAppearance(reid::Model model, const reid::EmbedderOptions& options)
    : embedder_(std::move(model), options) {}

int EmbeddingAppearance::dimension() const { return static_cast<int>(embedder_.dimension()); }

double EmbeddingAppearance::affinity_threshold() const {
  return embedder_.metadata().tau_a.value_or(reid::AffinityThreshold{}).value;
}

void EmbeddingAppearance::embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
                                Embeddings& out) {
  rects_.clear();
  for (const mot::Tlwh& box : boxes) {
    rects_.push_back({box.left - 1, box.top - 1, box.width, box.height});
  }
  embedder_.embed(frame, rects_, rows_);
  take_rows(out);
}

void EmbeddingAppearance::embed_shifted(const image::ImageView& frame, const mot::Tlwh& box,
                                        std::span<const BoxShift> shifts, Embeddings& out) {
  static_assert(BoxShift::kColumns == reid::WindowShift::kColumns &&
                BoxShift::kRows == reid::WindowShift::kRows);
  if (!embedder_.reads_windows()) {
    AppearanceModel::embed_shifted(frame, box, shifts, out);
    return;
  }
  shifts_.clear();
  for (const BoxShift& shift : shifts) shifts_.push_back({shift.columns, shift.rows});
  embedder_.embed_windows(frame, {box.left - 1, box.top - 1, box.width, box.height}, shifts_,
                          rows_);
  take_rows(out);
}

void EmbeddingAppearance::take_rows(Embeddings& out) {
  out.dimension = dimension();
  out.values.swap(rows_.values);
  out.valid.swap(rows_.valid);
}

}  // namespace sdmt::track
