// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sdmt/pipeline/frame_source.h"

namespace sdmt::pipeline {

/// How a source that never ends by itself is watched.
struct LiveOptions {
  /// Seconds without a frame after which a camera or stream counts as lost; opening it may take as
  /// long. 0.1..3600.
  double timeout = 10;
  /// Whether one that was lost is opened again, as often as it takes.
  bool reconnect = true;
  /// Seconds before the first attempt to open it again; doubled after each up to kLongestPause.
  /// 0.001..30.
  double first_pause = 0.5;
  /// Whether the newest frame alone is kept while nobody takes one. Otherwise none is lost, and
  /// whoever sends has to wait.
  bool newest_only = true;
  /// true: waiting for a frame ends as at the last one. Asked at least every 50 ms.
  std::function<bool()> stop;
  /// Takes one line: that it was lost, when and why, and that it is back.
  std::function<void(const std::string&)> tell;

  static constexpr double kLongestPause = 30;

  /// Throws std::invalid_argument for a value out of range.
  void validate() const;
};

/// A camera or stream read by a thread of its own, as frames come. Whoever tracks takes the newest
/// frame when it is ready for one; frames are numbered as they are taken, and tell when they came.
/// Where the source is lost it is opened again, and the numbers go on.
class LiveSource : public FrameSource {
 public:
  /// Opens the source; throws std::runtime_error when it does not answer.
  using Open = std::function<std::unique_ptr<FrameSource>()>;
  /// Becomes true when the LiveSource is to go, for a source that waits.
  using Closing = std::shared_ptr<std::atomic<bool>>;

  /// `first`: the source as it was opened first; `open` opens it again. `name` is for messages.
  /// Throws as LiveOptions::validate().
  LiveSource(std::string name, std::unique_ptr<FrameSource> first, Open open, Closing closing,
             LiveOptions options);
  ~LiveSource() override;

  /// The first call says for all whether frames are decoded.
  bool next(Frame& frame, bool decode) override;
  int frame_count() const override { return 0; }
  double frame_rate() const override { return frame_rate_; }
  image::PictureSize picture() const override;
  bool endless() const override { return true; }
  bool repeatable() const override { return false; }
  std::optional<LiveCounts> live() const override;

 private:
  using Clock = std::chrono::steady_clock;

  void read(std::unique_ptr<FrameSource> source, bool decode);
  bool hand_over(Frame frame, const FrameSource& source);
  std::unique_ptr<FrameSource> reopen();
  void say(std::string text);
  void tell_news();

  std::string name_;
  Open open_;
  LiveOptions options_;
  double frame_rate_;
  std::unique_ptr<FrameSource> first_;  // until the reader takes it

  Closing closing_;
  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  std::vector<std::string> news_;
  LiveCounts counts_;
  image::PictureSize picture_;
  bool ended_ = false;

  // Of the reader.
  Clock::time_point began_;
  bool begun_ = false;
  std::int64_t garbled_before_ = 0;  // by sources that were lost

  // Of whoever takes the frames.
  int number_ = 0;
  std::chrono::system_clock::time_point taken_;  // when the frame taken last came

  std::thread reader_;
};

/// `input` as for open_frame_source(). A camera or a stream without an end becomes a LiveSource.
/// "-" is a video that comes by standard input, and is read to its end however long it takes, none
/// of its frames left out. Throws as open_frame_source() and LiveOptions::validate().
std::unique_ptr<FrameSource> open_live_source(const std::string& input, const LiveOptions& options);

}  // namespace sdmt::pipeline
