// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/zone_writer.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sdmt/io/checked_value.h"
#include "sdmt/zones/counts_table.h"
#include "sdmt/zones/event_lines.h"

namespace sdmt::pipeline {

namespace {

// Dark where nobody stood, bright where people stood longest; the picture's size.
std::vector<unsigned char> heat_map_png(const zones::HeatMap& map, int width, int height) {
  const double most = *std::max_element(map.cells().begin(), map.cells().end());
  cv::Mat grey(map.rows(), map.columns(), CV_8UC1);
  std::transform(map.cells().begin(), map.cells().end(), grey.begin<unsigned char>(),
                 [most](double seconds) {
                   return cv::saturate_cast<unsigned char>(most > 0 ? 255 * seconds / most : 0);
                 });
  cv::Mat large, colors;
  cv::resize(grey, large, cv::Size(width, height), 0, 0, cv::INTER_LINEAR);
  cv::applyColorMap(large, colors, cv::COLORMAP_VIRIDIS);
  std::vector<unsigned char> bytes;
  cv::imencode(".png", colors, bytes);
  return bytes;
}

}  // namespace

ZoneWriter::ZoneWriter(const zones::ZonePlan& plan, double frame_rate, const ZoneFiles& files)
    : counter_(plan), heat_map_(plan.width, plan.height), frame_rate_(frame_rate) {
  io::require(frame_rate > 0, "frame rate", frame_rate, "above 0");
  if (!files.events.empty()) events_.emplace(files.events);
  if (!files.counts.empty()) counts_.emplace(files.counts);
  if (!files.heat_map.empty()) heat_map_file_.emplace(files.heat_map);
}

void ZoneWriter::write(const track::FinishedFrame& frame) {
  tell(counter_.add(frame, (frame.frame - 1) / frame_rate_));
  heat_map_.add(frame, 1 / frame_rate_);
}

void ZoneWriter::commit() {
  tell(counter_.finish());
  if (events_) events_->commit();
  if (counts_) {
    counts_->write(zones::counts_table(counter_));
    counts_->commit();
  }
  if (heat_map_file_) {
    const auto bytes = heat_map_png(heat_map_, counter_.plan().width, counter_.plan().height);
    heat_map_file_->write(bytes.data(), bytes.size());
    heat_map_file_->commit();
  }
}

void ZoneWriter::tell(const std::vector<zones::ZoneEvent>& events) {
  if (!events_) return;
  for (const zones::ZoneEvent& event : events) events_->write(zones::event_line(event));
}

}  // namespace sdmt::pipeline
