// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

namespace sdmt::tools {

struct SceneOptions {
  std::uint64_t seed = 1;
  int frames = 300;  ///< 1..1000000
  int walkers = 12;  ///< people at a time, 1..200
  int width = 960;   ///< pixels, 160..4096
  int height = 540;  ///< pixels, 120..4096
  double frame_rate = 25;
  bool uniform = false;  ///< everybody is dressed alike

  void validate() const;
};

/// Makes a MOTChallenge sequence in `folder` (new or empty): img1 (JPEG), seqinfo.ini, gt/gt.txt
/// (MOT16 columns, with the visible share of each box) and det/det.txt. The detector is made up
/// too: it misses people, the hidden ones most, moves and resizes boxes at random, and sees some
/// where there are none; scores are in 0..1. The same options give the same bytes.
/// `progress` is called with the number of frames that are done; returning false ends the work:
/// then nothing is left, and the function returns false. Throws std::invalid_argument when `folder`
/// already holds anything or cannot be made, std::runtime_error when writing fails.
bool write_scene(const std::filesystem::path& folder, const SceneOptions& options,
                 const std::function<bool(int)>& progress);

}  // namespace sdmt::tools
