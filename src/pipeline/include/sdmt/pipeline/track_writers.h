// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/unreadable_frames.h"
#include "sdmt/track/finished_frame.h"

namespace sdmt::pipeline {

/// Something that takes finished frames, in order.
class TrackWriter {
 public:
  virtual ~TrackWriter() = default;

  /// Whether read() has to get images.
  virtual bool needs_images() const { return false; }
  /// A frame of the input, before it is tracked.
  virtual void read(const Frame&) {}
  virtual void write(const track::FinishedFrame& frame) = 0;
  /// Makes the output visible; nothing is to be seen of a file before.
  virtual void commit() = 0;
};

/// MOTChallenge result rows. "-" writes to standard output, each frame at once. Throws as
/// io::OutputFile.
std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path);

/// One JSON object a line and finished frame:
/// {"frame":7,"tracks":[{"id":1,"box":[left,top,width,height],"score":0.91,"source":"detected"}],
///  "merges":[{"from":9,"to":1}]}
/// "-" writes to standard output, each line at once. Throws as io::OutputFile.
std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path);

/// A video of the frames with the tracks drawn in (TrackRenderer), at the input's frame rate, or 25
/// frames a second where that is not known. `input` and `source` as for FrameReplay; frames that
/// cannot be read are drawn grey and added to `unreadable`, which has to live as long. Throws as
/// VideoOutputFile.
std::unique_ptr<TrackWriter> make_video_writer(const std::string& path, const std::string& input,
                                               const FrameSource& source,
                                               UnreadableFrames& unreadable);

}  // namespace sdmt::pipeline
