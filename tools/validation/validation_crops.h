// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/frame_range.h"
#include "sdmt/image/patch.h"

namespace sdmt::tools {

/// One box to validate on.
struct ValidationCrop {
  std::filesystem::path image;
  std::optional<image::PixelRect> rect;  ///< absent: the whole image
  int pid = 0;                           ///< reid::kDistractorPid: nobody
  int camid = 0;
  bool query = true;                ///< is searched for
  bool gallery = true;              ///< is searched in
  std::filesystem::path root = {};  ///< the folder it was listed from

  /// File name without its ending, with the box where there is one.
  std::string label() const;
};

struct ValidationCropOptions {
  /// A folder in the layout of Market-1501 (query and bounding_box_test), a plain folder of such
  /// images (all of them query and gallery), or a MOT sequence (boxes of its ground truth).
  std::filesystem::path data;
  /// A folder of background images to add to the gallery, whatever their names; may be empty.
  std::filesystem::path distractors;
  /// MOT sequences: frames 1, 1 + frame_step, ...; >= 1. Neighbouring frames are nearly the same
  /// image, which would count as an easy positive.
  int frame_step = 10;
  FrameRange frames;  ///< of MOT sequences
};

/// Lists what to validate on, in an order that depends on nothing but names. Of a MOT sequence,
/// boxes that reach beyond the image or are not to be evaluated are left out. Images are not
/// opened. Throws std::invalid_argument naming folder or file when there is nothing to list, as
/// reid::list_reid_images(), or as the MOT readers do.
std::vector<ValidationCrop> list_validation_crops(const ValidationCropOptions& options);

}  // namespace sdmt::tools
