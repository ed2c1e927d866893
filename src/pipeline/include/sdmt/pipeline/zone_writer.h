// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "sdmt/io/output_file.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/zones/heat_map.h"
#include "sdmt/zones/zone_counter.h"

namespace sdmt::pipeline {

/// What is to be kept of zones; an empty path is not wanted.
struct ZoneFiles {
  std::string events;    ///< zones::event_line()s
  std::string counts;    ///< zones::counts_table()
  std::string heat_map;  ///< picture of where people stood, PNG
};

/// Counts the people of finished frames in zones.
class ZoneWriter : public TrackWriter {
 public:
  /// `plan` is one for the input's picture, as ZonePlan::in_picture() makes it. Flowing, events are
  /// written as they are told, and the other files every kBetweenSummaries seconds. Throws as
  /// zones::ZoneCounter, open_line_output() and io::OutputFile.
  ZoneWriter(const zones::ZonePlan& plan, const ZoneFiles& files,
             const std::optional<Flowing>& flowing = {});

  static constexpr double kBetweenSummaries = 60;

  /// Takes each zones::event_line(), beside the file.
  void tell_events_to(std::function<void(const std::string&)> listener) {
    listener_ = std::move(listener);
  }

  /// Throws std::invalid_argument for a frame without a time. Frames with one of the wall clock are
  /// counted in its hours, UTC.
  void write(const track::FinishedFrame& frame, const FrameTime& time) override;
  void commit() override;

  /// Looks once a second whether `file` or the `size` of the pictures has changed, and counts by
  /// what `read` makes of them from then on: stays end, what was counted so far is put aside as
  /// rotated_name() says, and counts begin anew. Where `read` throws, that is told, and the old
  /// plan stays. Flowing only.
  void follow(std::filesystem::path file, std::function<image::PictureSize()> size,
              std::function<zones::ZonePlan()> read);

  const zones::ZoneCounter& counter() const { return counter_; }

 private:
  struct Stamp {  // what changes with the file or the pictures
    std::filesystem::file_time_type time;
    std::uintmax_t bytes = 0;
    image::PictureSize size;
    bool operator==(const Stamp&) const = default;
  };

  void look_at_plan();
  Stamp stamp() const;
  void tell(const std::vector<zones::ZoneEvent>& events);
  void write_summaries();

  std::filesystem::path plan_file_;  // that is followed
  std::function<image::PictureSize()> size_;
  std::function<zones::ZonePlan()> read_plan_;
  Stamp plan_stamp_;
  std::chrono::steady_clock::time_point looked_;
  zones::ZoneCounter counter_;
  zones::HeatMap heat_map_;
  ZoneFiles files_;
  std::optional<Flowing> flowing_;
  std::unique_ptr<LineOutput> events_;
  std::function<void(const std::string&)> listener_;
  std::unique_ptr<io::OutputFile> counts_, heat_map_file_;  // where the input has an end
  std::optional<double> time_;                              // of the last frame
  double interval_ = 0;                                     // between the last two, seconds
  double summary_ = 0;                                      // when summaries were written last
  double wall_ = 0;  // what is added to times to get seconds of the wall clock; 0: there is none
};

}  // namespace sdmt::pipeline
