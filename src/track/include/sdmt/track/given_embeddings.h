// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/mot/detection.h"

namespace sdmt::track {

/// The appearance that boxes bring along: vectors of length 1 that somebody else's network made of
/// them. Crops are told apart by where they are; one that is none of the boxes has no vector, so
/// boosting finds nothing. The images of the crops are not looked at.
class GivenEmbeddings : public image::CropDescriptor {
 public:
  /// The boxes of the next frame and their vectors, [boxes, dimension]. Throws
  /// std::invalid_argument for vectors that are not as many and as long as those before.
  void set(std::span<const mot::Detection> boxes, std::span<const float> vectors);

  std::string name() const override { return "given embeddings"; }
  int dimension() const override { return dimension_; }
  /// Not known: it belongs to the network that made them.
  std::optional<double> tau_a() const override { return std::nullopt; }
  void describe(std::span<const image::Crop> crops, image::DescriptorRows& out) override;

 private:
  int dimension_ = 0;
  std::vector<image::PixelRect> rects_;
  std::vector<float> vectors_;
};

/// Scales `rows` vectors of one length, one after the other, to length 1. Throws
/// std::invalid_argument naming the first that has none or is not finite.
void scale_to_unit_rows(std::span<float> vectors, std::size_t rows);

}  // namespace sdmt::track
