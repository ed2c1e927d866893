// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/image/patch.h"

namespace sdmt::image {

/// A box of an image whose appearance is wanted. It may leave the image.
struct Crop {
  ImageView image;
  PixelRect rect;
};

/// Vectors of crops, row after row.
struct DescriptorRows {
  int dimension = 0;                 ///< values of a row
  std::vector<float> values;         ///< [crops, dimension]; zeros where not valid
  std::vector<unsigned char> valid;  ///< [crops]; 0 where the crop has no visible_region()

  std::span<const float> row(std::size_t i) const {
    const auto size = static_cast<std::size_t>(dimension);
    return std::span(values).subspan(i * size, size);
  }
  std::span<float> row(std::size_t i) {
    const auto size = static_cast<std::size_t>(dimension);
    return std::span(values).subspan(i * size, size);
  }
  /// `crops` rows of zeros, none of them valid.
  void reset(std::size_t crops, int new_dimension) {
    dimension = new_dimension;
    values.assign(crops * static_cast<std::size_t>(new_dimension), 0.0F);
    valid.assign(crops, 0);
  }
};

/// Moves a window on a grid: by so many 16ths of its width to the right and 32nds of its height
/// down.
struct GridShift {
  static constexpr int kColumns = 16;  ///< cells across a window
  static constexpr int kRows = 32;     ///< cells down a window

  int columns = 0;
  int rows = 0;

  /// `box` is anything made of left, top, width and height.
  template <typename Box>
  Box applied_to(const Box& box) const {
    return {box.left + columns * box.width / kColumns, box.top + rows * box.height / kRows,
            box.width, box.height};
  }
};

/// Turns crops of people into vectors whose Euclidean distance d says how unlike two people look.
/// One interface for tracking, validation and export: derive from it to bring your own appearance,
/// such as the vectors that a detector computes anyway.
class CropDescriptor {
 public:
  virtual ~CropDescriptor() = default;

  /// For tables and messages.
  virtual std::string name() const = 0;
  /// Values of a row, the same for every call.
  virtual int dimension() const = 0;
  /// Two crops show one person when 1 - d exceeds this value, -1 to 1 (section III-B of the paper);
  /// nothing when no such threshold is known.
  virtual std::optional<double> tau_a() const = 0;
  /// One row for each crop, in order, which does not depend on the other crops of the call. For
  /// tracking the rows of valid crops have length 1.
  virtual void describe(std::span<const Crop> crops, DescriptorRows& out) = 0;
  /// One row for each shift of `window`, all of which lie in the image. Descriptors that can share
  /// work between overlapping windows do so here, and their rows may then differ a little from
  /// those of describe(); by default each shifted window is a crop of its own.
  virtual void describe_shifted(const ImageView& image, const PixelRect& window,
                                std::span<const GridShift> shifts, DescriptorRows& out);
};

}  // namespace sdmt::image
