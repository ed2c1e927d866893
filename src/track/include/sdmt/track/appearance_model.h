// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "sdmt/image/image_view.h"
#include "sdmt/mot/box.h"

namespace sdmt::track {

/// Feature vectors of the boxes of one frame, row after row.
struct Embeddings {
  int dimension = 0;
  std::vector<float> values;         ///< [boxes, dimension]; rows of valid boxes have length 1
  std::vector<unsigned char> valid;  ///< [boxes]; 0 where no crop could be taken

  std::span<const float> row(std::size_t i) const {
    return {values.data() + i * static_cast<std::size_t>(dimension),
            static_cast<std::size_t>(dimension)};
  }
};

/// Moves a box on a grid: by so many 16ths of its width and 32nds of its height.
struct BoxShift {
  static constexpr int kColumns = 16;
  static constexpr int kRows = 32;

  int columns = 0;
  int rows = 0;

  mot::Tlwh applied_to(const mot::Tlwh& box) const {
    return {box.left + columns * box.width / kColumns, box.top + rows * box.height / kRows,
            box.width, box.height};
  }
};

/// Turns boxes into feature vectors whose Euclidean distance d says how alike two people look;
/// affinity is 1 - d (section III-B of the paper).
class AppearanceModel {
 public:
  virtual ~AppearanceModel() = default;

  virtual int dimension() const = 0;
  /// tau_a: pairs with affinity above it count as the same person.
  virtual double affinity_threshold() const = 0;
  /// Embeds the boxes of one frame in one batch; `out` gets one row a box. Boxes may leave the
  /// image.
  virtual void embed(const image::ImageView& frame, std::span<const mot::Tlwh> boxes,
                     Embeddings& out) = 0;
  /// Embeds `box` moved by each shift; all of these lie in the image. Models that can share work
  /// between overlapping boxes do so here, and their rows may then differ a little from embed()'s.
  virtual void embed_shifted(const image::ImageView& frame, const mot::Tlwh& box,
                             std::span<const BoxShift> shifts, Embeddings& out);
};

}  // namespace sdmt::track
