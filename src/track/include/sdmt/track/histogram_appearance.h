// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/track/appearance_model.h"

namespace sdmt::track {

/// Appearance by image::color_histogram(), without learning: the baseline that a network has to
/// beat.
class HistogramAppearance final : public AppearanceModel {
 public:
  int dimension() const override;
  /// 0.3: distances of histograms are larger than those of embeddings.
  double affinity_threshold() const override;
  void embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
             Embeddings& out) override;
};

}  // namespace sdmt::track
