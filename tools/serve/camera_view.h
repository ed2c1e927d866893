// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sdmt/pipeline/frame_source.h"
#include "sdmt/pipeline/sequence_runner.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/zones/zone_counter.h"

namespace sdmt::tools {

/// What is to be seen of one camera: written by its tracker, looked at by any thread.
class CameraView {
 public:
  explicit CameraView(std::string name) : name_(std::move(name)) {}

  const std::string& name() const { return name_; }

  /// The state as a JSON object, as docs/camera-state.schema.json describes it.
  std::string state() const;
  /// Lines for Prometheus, without the comments that describe them.
  std::string metrics() const;
  /// The newest picture, JPEG, once it is a later one than `after`, which then becomes its number;
  /// empty when there is none within a second, or the camera is done.
  std::vector<std::uint8_t> picture(std::int64_t& after) const;
  /// The first picture from now on; as picture(), but waits up to two seconds.
  std::vector<std::uint8_t> next_picture() const;
  /// While viewers look, pictures are drawn.
  void viewer_came() { ++viewers_; }
  void viewer_left() { --viewers_; }
  bool is_watched() const { return viewers_ > 0; }
  bool is_running() const;
  /// Whether there are pictures; true until said otherwise.
  void set_pictures(bool pictures) { has_pictures_ = pictures; }
  bool has_pictures() const { return has_pictures_; }

  void show(const track::FinishedFrame& frame, const pipeline::FrameTime& time,
            const std::optional<pipeline::LiveCounts>& live);
  void show_picture(std::vector<std::uint8_t> jpeg);
  void show_zones(const zones::ZoneCounter& counter);
  /// A zones::event_line().
  void show_event(const std::string& line);
  void show_stages(const pipeline::RunReport& report);
  void end();

 private:
  std::string name_;
  std::atomic<int> viewers_ = 0;
  std::atomic<bool> has_pictures_ = true;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool running_ = true;
  track::FinishedFrame frame_;
  pipeline::FrameTime time_;
  std::optional<pipeline::LiveCounts> live_;
  std::int64_t frames_ = 0;
  int most_ = 0;                                 // people at once
  int largest_id_ = 0;                           // people so far
  std::chrono::steady_clock::time_point shown_;  // when frame_ was
  zones::ZonePlan plan_;
  std::vector<zones::LineCounts> lines_;
  std::vector<zones::AreaCounts> areas_;
  std::deque<std::string> events_;  // the last ones, JSON objects
  std::int64_t event_count_ = 0;
  std::vector<std::pair<const char*, double>> stages_;  // seconds
  std::vector<std::uint8_t> picture_;
  std::int64_t pictures_ = 0;
};

/// Feeds a view: a writer beside those of files.
class ViewWriter : public pipeline::TrackWriter {
 public:
  /// As pipeline::make_video_writer(); pictures are blurred likewise. `pictures`: whether there are
  /// any. `view` and `source` must outlive it.
  ViewWriter(CameraView& view, const std::string& input, const pipeline::FrameSource& source,
             bool pictures, bool blur);
  ~ViewWriter() override;

  bool needs_images() const override;
  void read(const pipeline::Frame& frame) override;
  void write(const track::FinishedFrame& frame, const pipeline::FrameTime& time) override;
  void commit() override {}

 private:
  struct Pictures;
  CameraView& view_;
  const pipeline::FrameSource& source_;
  bool blur_;
  std::unique_ptr<Pictures> pictures_;
};

}  // namespace sdmt::tools
