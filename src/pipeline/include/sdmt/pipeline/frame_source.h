// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdmt/image/image.h"
#include "sdmt/image/picture_size.h"

namespace sdmt::pipeline {

/// When a frame was.
struct FrameTime {
  /// Seconds from the first frame, as the input tells or as frames come; nothing where it is not
  /// known. Never falls.
  std::optional<double> time = std::nullopt;
  /// When it came from a camera or stream.
  std::optional<std::chrono::system_clock::time_point> wall_clock = std::nullopt;
};

/// One frame of the input. Without an image: this frame exists but cannot be read (a damaged file),
/// or the sequence comes without images.
struct Frame {
  int number = 0;       ///< 1-based
  image::Image image;   ///< upright, as a player shows it
  std::string problem;  ///< why there is no image, naming file or frame; empty when it just is not
                        ///< there to be read
  FrameTime when = {};

  bool has_image() const { return !image.bgr.empty(); }
};

/// What became of the frames of a camera or stream.
struct LiveCounts {
  std::int64_t received = 0;
  std::int64_t dropped = 0;  ///< of them, because a newer one was there before anybody took it
  std::int64_t garbled = 0;  ///< that came beside them and could not be decoded
  std::int64_t losses = 0;   ///< times that it was lost
  double lag = 0;            ///< seconds from its coming until the last frame was done with
  double longest_lag = 0;
};

/// What every input offers: its frames, one after the other.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Goes to the next frame; false at the end. A frame that cannot be read does not end the input.
  /// decode = false: only its number is wanted, the image stays empty.
  virtual bool next(Frame& frame, bool decode) = 0;
  /// Frames from the beginning; 0 when not known (a camera, some videos).
  virtual int frame_count() const = 0;
  /// Frames per second, 0.1 to 5000; 0 when not known.
  virtual double frame_rate() const = 0;
  /// Size of the images of a camera or stream, as it is now; 0 and 0 for others, and where it is
  /// not known.
  virtual image::PictureSize picture() const { return {}; }
  /// Whether frames come with images at all; false for a MOT sequence without its img1.
  virtual bool has_images() const { return true; }
  /// Whether it has no end of its own, as a camera or a stream without a length: when frames stop
  /// coming, it was lost.
  virtual bool endless() const { return false; }
  /// Whether the input can be opened again to see the same frames.
  virtual bool repeatable() const { return true; }
  /// Frames that came but could not be decoded, and that next() has passed over.
  virtual std::int64_t garbled() const { return 0; }
  /// After next() has returned false: why there are no more frames, as part of a message.
  virtual std::string why_it_ended() const { return "it gives no more frames"; }
  /// Nothing but for LiveSource.
  virtual std::optional<LiveCounts> live() const { return std::nullopt; }
  /// What whoever gave the input should know: how images are numbered when it is not from 1, what
  /// of a folder is passed over and why. One line each.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Where frame numbers do not follow from the names of the images: how the two go together. To be
  /// said when boxes come with frame numbers. Empty otherwise.
  virtual std::string numbering() const { return {}; }
};

/// `input` is a MOTChallenge sequence folder (with seqinfo.ini), a folder of images (in natural
/// order: 2.jpg before 10.jpg), a video file, "camera:N", or a stream's URL (rtsp://, http://,
/// ...), or "-": frames without images and without an end, for boxes that come live. Videos are
/// decoded by FFmpeg; opening or waiting for a frame takes 10 seconds at most. Throws
/// std::invalid_argument when there is no such input, it holds no frames or is no video,
/// std::runtime_error when a camera or stream does not answer.
std::unique_ptr<FrameSource> open_frame_source(const std::string& input);

/// Whether `input` names a camera or a URL.
bool is_live(const std::string& input);

/// Size of an input's images: what seqinfo.ini states, else that of the first image that can be
/// read; 0 and 0 where there is none, or the input cannot be opened a second time.
image::PictureSize picture_size(const std::string& input);
/// The same where the input is open: a camera or stream knows.
image::PictureSize picture_size(const FrameSource& frames, const std::string& input);

/// An input as messages name it: the user, password and query of a URL are replaced by "***".
std::string display_name(const std::string& input);

}  // namespace sdmt::pipeline
