// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace sdmt::pipeline {

/// What has to be done to a stored picture before it is upright: first mirrored left to right, then
/// turned clockwise by quarters.
struct Orientation {
  bool mirrored = false;
  int quarter_turns = 0;  ///< 0 to 3
};

/// The orientation that the track header of the first video track of an MP4, MOV or 3GP file states
/// (ISO/IEC 14496-12, section 8.3.2), as phones write it; upright for matrices that are no multiple
/// of a quarter turn. Nothing for files of other kinds.
std::optional<Orientation> read_display_matrix(const std::filesystem::path& file);

}  // namespace sdmt::pipeline
