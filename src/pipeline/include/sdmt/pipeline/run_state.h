// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "sdmt/io/hash.h"
#include "sdmt/track/tracker.h"

namespace sdmt::pipeline {

/// What lets a run that was killed go on as if it had not been: the file `path` with a snapshot of
/// the tracker, and `path`.frames with the frames that were finished until then, a line each.
/// The first appears whole or not at all; the second grows, and what it has more than the first
/// knows of is cut off when the run goes on.
class RunState {
 public:
  /// `run`: what makes two runs the same, such as input and detections. `interval`: frames between
  /// two snapshots, >= 1. Throws std::invalid_argument when `path` holds anything but the state of
  /// such a run, std::runtime_error when a file cannot be read or written.
  RunState(std::filesystem::path path, std::string run, int interval);
  ~RunState();
  RunState(const RunState&) = delete;
  RunState& operator=(const RunState&) = delete;

  /// Brings a new tracker to where the run was and hands over the frames finished until then;
  /// returns how many frames it had taken, 0 where there is nothing to go on from. Throws as
  /// track::Tracker::restore() and for lines that cannot be read.
  int resume(track::Tracker& tracker,
             const std::function<void(const track::FinishedFrame&)>& finished);

  void add(const track::FinishedFrame& frame);
  /// After each frame: a snapshot when it is time for one.
  void frame_done(const track::Tracker& tracker);
  void save(const track::Tracker& tracker);
  /// The run has come to its end: both files go.
  void remove();

 private:
  std::filesystem::path frames_path() const;

  std::filesystem::path path_;
  std::string run_;
  int interval_;
  std::string snapshot_;                 // to go on from; empty for a new run
  int finished_ = 0;                     // frames handed over until now
  std::uint64_t hash_ = io::kEmptyHash;  // of their lines
  int since_ = 0;                        // frames since the last snapshot
  std::string pending_;                  // lines not yet written
  int frames_ = -1;                      // descriptor
};

}  // namespace sdmt::pipeline
