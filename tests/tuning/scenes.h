// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/run_command.h"
#include "sdmt/tuning/tuning_plan.h"

namespace sdmt::tuning {

/// A folder of two sequences, s1 and s2, of kFrames frames and no images. Two people walk; the
/// detector misses one of them now and then and finds something weak besides.
class Scenes {
 public:
  static constexpr int kFrames = 20;

  Scenes();
  std::string path() const { return folder_.path(); }
  std::string file(const std::string& name) const { return folder_ / name; }
  /// To try two options, three values each, on both.
  TuningOptions options() const;

 private:
  tests::TemporaryFolder folder_;
};

}  // namespace sdmt::tuning
