// SPDX-License-Identifier: Apache-2.0
#include "sdmt/track/histogram_appearance.h"

#include <cstddef>

#include "sdmt/image/color_histogram.h"

namespace sdmt::track {

int HistogramAppearance::dimension() const { return image::kColorHistogramSize; }

double HistogramAppearance::affinity_threshold() const { return 0.3; }

void HistogramAppearance::embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
                                Embeddings& out) {
  constexpr std::size_t kLength = image::kColorHistogramSize;
  out.dimension = image::kColorHistogramSize;
  out.values.assign(boxes.size() * kLength, 0.0F);
  out.valid.assign(boxes.size(), 0);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const mot::Tlwh& box = boxes[i];
    const bool valid =
        image::color_histogram(frame, {box.left - 1, box.top - 1, box.width, box.height},
                               std::span(out.values).subspan(i * kLength, kLength));
    out.valid[i] = valid ? 1 : 0;
  }
}

}  // namespace sdmt::track
