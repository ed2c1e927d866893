// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/io/output_file.h"
#include "sdmt/track/tracker.h"

namespace sdmt::pipeline {

/// A CSV file with a line for each of a tracker's decisions about two tracklets:
/// frame,older,newer,gap,affinity,verdict.
class AssociationLog {
 public:
  /// Listens to `tracker`, which must not outlive it. Throws as io::OutputFile.
  AssociationLog(const std::string& path, track::Tracker& tracker);

  /// Makes the file visible. Throws as io::OutputFile.
  void commit() { file_.commit(); }

 private:
  io::OutputFile file_;
};

}  // namespace sdmt::pipeline
