// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/line_output.h"
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
  /// `time`: of that frame.
  virtual void write(const track::FinishedFrame& frame, const FrameTime& time) = 0;
  /// Makes the output visible; nothing is to be seen of a file before, unless it flows.
  virtual void commit() = 0;
};

/// MOTChallenge result rows. Throws as open_line_output().
std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path,
                                             const std::optional<Flowing>& flowing = {});

/// A finished frame as a JSON object with a line end, as docs/track-lines.schema.json describes it:
/// {"version":1,"source":"rtsp://***@host/a","frame":7,"time":0.24,"utc":"2026-03-01T14:05:09.250Z",
///  "tracks":[{"id":1,"box":[left,top,width,height],"score":0.91,"source":"detected"}],
///  "merges":[{"from":9,"to":1}]}
/// "time" in seconds from the first frame where it is known, "utc" for cameras and streams.
/// `source` names the input.
std::string finished_frame_line(const std::string& source, const track::FinishedFrame& frame,
                                const FrameTime& time);

/// finished_frame_line()s. "-" as `path` writes to standard output. Throws as open_line_output().
std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path, const std::string& source,
                                               const std::optional<Flowing>& flowing = {});

/// A video of the frames with the tracks drawn in (TrackRenderer), at the input's frame rate, or 25
/// frames a second where that is not known. Where times tell that frames come irregularly, they are
/// shown as long as they lasted, at most kLongestStill seconds. `input` and `source` as for
/// FrameReplay; frames that cannot be read are drawn grey and added to `unreadable`, which has to
/// live as long. Flowing, it is written in pieces, NAME.TIME.mkv. Throws as VideoOutputFile.
std::unique_ptr<TrackWriter> make_video_writer(const std::string& path, const std::string& input,
                                               const FrameSource& source,
                                               UnreadableFrames& unreadable,
                                               const std::optional<Flowing>& flowing = {},
                                               bool blur = false);

/// The longest that a frame of a video is shown, however late the next one comes, seconds.
inline constexpr double kLongestStill = 10;

}  // namespace sdmt::pipeline
