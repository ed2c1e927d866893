// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

namespace sdmt::tools {

struct ReidSetOptions {
  int identities = 300;         ///< 4..9999; the first two thirds are for training
  int images_per_identity = 8;  ///< 4..1000, by two cameras in turn
  std::uint64_t seed = 1;

  /// Images in all, the background ones of the gallery included.
  int images() const;

  /// Throws std::invalid_argument naming field, value and bound.
  void validate() const;
};

/// Makes a practice set in the layout of Market-1501: bounding_box_train, query (one image a camera
/// for each test identity) and bounding_box_test (their other images and background as pid 0000).
/// Crops of 64 x 128 of made-up people, whose clothes tell them apart, before clutter, in any
/// direction and step, badly cropped, half hidden, by two cameras of different colours under
/// changing light. The same options give the same files. `progress` gets the number of images
/// written and returns false to stop: then nothing is left, and the function returns false.
/// Throws std::invalid_argument when `folder` already holds anything or cannot be made,
/// std::runtime_error when writing fails.
bool write_reid_set(const std::filesystem::path& folder, const ReidSetOptions& options,
                    const std::function<bool(int)>& progress);

}  // namespace sdmt::tools
