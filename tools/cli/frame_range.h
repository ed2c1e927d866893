// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <limits>
#include <string>

namespace sdmt::tools {

/// Some frames of a video or sequence, counted from 1.
struct FrameRange {
  int first = 1;
  int last = std::numeric_limits<int>::max();

  bool contains(int frame) const { return first <= frame && frame <= last; }
};

/// "A-B", "A-" or "-B". Throws std::invalid_argument for anything else.
FrameRange parse_frame_range(const std::string& text);

/// Adds --frames. `range` must live until the command line is parsed.
void add_frame_range(CLI::App& command, FrameRange& range, const std::string& help);

}  // namespace sdmt::tools
