// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sdmt/track/finished_frame.h"

namespace sdmt::pipeline {

/// Something that takes finished frames, in order.
class TrackWriter {
 public:
  virtual ~TrackWriter() = default;
  virtual void write(const track::FinishedFrame& frame) = 0;
  /// Makes the output visible; nothing is to be seen of a file before.
  virtual void commit() = 0;
};

/// MOTChallenge result rows. Throws as io::OutputFile.
std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path);

/// One JSON object a line and finished frame:
/// {"frame":7,"tracks":[{"id":1,"box":[left,top,width,height],"score":0.91,"source":"detected"}],
///  "merges":[{"from":9,"to":1}]}
/// "-" writes to standard output, each line at once. Throws as io::OutputFile.
std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path);

}  // namespace sdmt::pipeline
