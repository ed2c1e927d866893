// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "sdmt/image/crop_descriptor.h"
#include "sdmt/image/image_view.h"
#include "sdmt/image/patch.h"

namespace sdmt::image {

/// Length of a colour histogram: 8 horizontal stripes of 8 x 4 hue-saturation and 4 value bins.
inline constexpr int kColorHistogramSize = 8 * (8 * 4 + 4);

/// Appearance without learning, the baseline to beat: the box is shrunk to 64 x 32 pixels by area
/// averaging, its columns 4..27 are cut into 8 stripes of 8 rows, and each stripe counts its pixels
/// in hue x saturation (8 x 4) and value (4) bins of OpenCV's 8-bit HSV. The counts are divided by
/// their sum and rooted (to the bit the bins that cv2.resize, INTER_AREA, and cv2.cvtColor give),
/// so that the vector has length 1 and Euclidean distance is sqrt(2) times the Hellinger distance.
/// Returns false, with `out` untouched, when the box has no visible_region() or the image is empty.
/// Throws std::invalid_argument when out.size() is not kColorHistogramSize.
bool color_histogram(const ImageView& image, const PixelRect& rect, std::span<float> out);

/// The same as a descriptor.
class ColorHistogramDescriptor final : public CropDescriptor {
 public:
  std::string name() const override { return "colour histogram"; }
  int dimension() const override { return kColorHistogramSize; }
  /// 0.3: distances of histograms are larger than those of embeddings.
  std::optional<double> tau_a() const override { return 0.3; }
  void describe(std::span<const Crop> crops, DescriptorRows& out) override;
};

}  // namespace sdmt::image
