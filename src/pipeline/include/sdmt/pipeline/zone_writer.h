// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  /// `plan` is one for the input's picture, as ZonePlan::in_picture() makes it; frames are 1 /
  /// `frame_rate` seconds apart, the first is at 0. Throws std::invalid_argument for a frame rate
  /// that is not above 0, as zones::ZoneCounter, and as io::OutputFile.
  ZoneWriter(const zones::ZonePlan& plan, double frame_rate, const ZoneFiles& files);

  void write(const track::FinishedFrame& frame) override;
  void commit() override;

  const zones::ZoneCounter& counter() const { return counter_; }

 private:
  void tell(const std::vector<zones::ZoneEvent>& events);

  zones::ZoneCounter counter_;
  zones::HeatMap heat_map_;
  double frame_rate_;
  std::optional<io::OutputFile> events_, counts_, heat_map_file_;
};

}  // namespace sdmt::pipeline
