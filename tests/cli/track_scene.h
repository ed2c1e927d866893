// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/run_command.h"

namespace sdmt::tests {

/// A folder with things to track.
class TrackScene : public testing::Test {
 protected:
  /// A MOT sequence without frames: `people` walk to the right for `frames` frames.
  std::string motion_sequence(const std::string& name, int frames, int people);
  /// A MOT sequence with frames, made by `sdmt synth scene`.
  std::string picture_sequence(const std::string& name, int frames);
  /// `sdmt track INPUT --output tracks.txt ...`
  CommandResult track(const std::string& input, std::vector<std::string> more);
  std::string tracks() const { return read_file(folder_ / "tracks.txt"); }
  bool has_tracks() const { return std::filesystem::exists(folder_ / "tracks.txt"); }

  TemporaryFolder folder_;
};

}  // namespace sdmt::tests
