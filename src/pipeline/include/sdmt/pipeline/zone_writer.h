// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

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

  /// Throws std::invalid_argument for a frame without a time. Frames with one of the wall clock are
  /// counted in its hours, UTC.
  void write(const track::FinishedFrame& frame, const FrameTime& time) override;
  void commit() override;

  const zones::ZoneCounter& counter() const { return counter_; }

 private:
  void tell(const std::vector<zones::ZoneEvent>& events);
  void write_summaries();

  zones::ZoneCounter counter_;
  zones::HeatMap heat_map_;
  ZoneFiles files_;
  std::optional<Flowing> flowing_;
  std::unique_ptr<LineOutput> events_;
  std::unique_ptr<io::OutputFile> counts_, heat_map_file_;  // where the input has an end
  std::optional<double> time_;                              // of the last frame
  double interval_ = 0;                                     // between the last two, seconds
  double summary_ = 0;                                      // when summaries were written last
  double wall_ = 0;  // what is added to times to get seconds of the wall clock; 0: there is none
};

}  // namespace sdmt::pipeline
