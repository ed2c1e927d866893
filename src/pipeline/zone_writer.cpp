// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/zone_writer.h"

#include <algorithm>
#include <chrono>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "mat_view.h"
#include "sdmt/media/image_file.h"
#include "sdmt/pipeline/utc_time.h"
#include "sdmt/zones/counts_table.h"
#include "sdmt/zones/event_lines.h"

namespace sdmt::pipeline {

namespace {

// Dark where nobody stood, bright where people stood longest; the picture's
// size.
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
  return media::encode_png(to_image(colors));
}

std::chrono::system_clock::time_point at_second(double since_1970) {
  using Clock = std::chrono::system_clock;
  return Clock::time_point(
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(since_1970)));
}

}  // namespace

ZoneWriter::ZoneWriter(const zones::ZonePlan& plan, const ZoneFiles& files,
                       const std::optional<Flowing>& flowing)
    : counter_(plan), heat_map_(plan.width, plan.height), files_(files), flowing_(flowing) {
  if (!files.events.empty()) events_ = open_line_output(files.events, flowing);
  if (flowing) return;
  if (!files.counts.empty()) counts_ = std::make_unique<io::OutputFile>(files.counts);
  if (!files.heat_map.empty()) heat_map_file_ = std::make_unique<io::OutputFile>(files.heat_map);
}

void ZoneWriter::write(const track::FinishedFrame& frame, const FrameTime& time) {
  if (!time.time) throw std::invalid_argument("zones need the time of each frame");
  look_at_plan();
  if (!time_ && time.wall_clock) {
    const std::chrono::duration<double> since_1970 = time.wall_clock->time_since_epoch();
    wall_ = since_1970.count() - *time.time;
  }
  // Longer than that nobody was seen to stand anywhere.
  constexpr double kLongestInterval = 2;
  if (time_) interval_ = std::min(*time.time - *time_, kLongestInterval);
  time_ = time.time;
  tell(counter_.add(frame, *time.time + wall_));
  heat_map_.add(frame, interval_);
  if (flowing_ && *time_ - summary_ >= kBetweenSummaries) {
    summary_ = *time_;
    write_summaries();
  }
}

void ZoneWriter::commit() {
  tell(counter_.finish());
  if (events_) events_->commit();
  write_summaries();
}

void ZoneWriter::follow(std::filesystem::path file, std::function<image::PictureSize()> size,
                        std::function<zones::ZonePlan()> read) {
  plan_file_ = std::move(file);
  size_ = std::move(size);
  read_plan_ = std::move(read);
  plan_stamp_ = stamp();
}

ZoneWriter::Stamp ZoneWriter::stamp() const {
  std::error_code failed;
  Stamp stamp{std::filesystem::last_write_time(plan_file_, failed), 0, size_()};
  if (!failed) stamp.bytes = std::filesystem::file_size(plan_file_, failed);
  return failed ? plan_stamp_ : stamp;  // it may just be replaced
}

void ZoneWriter::look_at_plan() {
  const auto now = std::chrono::steady_clock::now();
  if (!read_plan_ || now - looked_ < std::chrono::seconds(1)) return;
  looked_ = now;
  const Stamp seen = stamp();
  if (seen == plan_stamp_) return;
  plan_stamp_ = seen;
  try {
    zones::ZoneCounter anew(read_plan_());
    tell(counter_.finish());
    write_summaries();
    if (std::error_code failed; !files_.counts.empty()) {
      std::filesystem::rename(files_.counts, rotated_name(files_.counts), failed);
    }
    const bool resized =
        anew.plan().width != counter_.plan().width || anew.plan().height != counter_.plan().height;
    if (resized) heat_map_ = zones::HeatMap(anew.plan().width, anew.plan().height);
    counter_ = std::move(anew);
    flowing_->tell(plan_file_.string() + ": is read again; counts begin anew");
  } catch (const std::exception& error) {
    flowing_->tell(std::string(error.what()) + "; the zones stay as they were");
  }
}

void ZoneWriter::tell(const std::vector<zones::ZoneEvent>& events) {
  for (zones::ZoneEvent event : events) {
    std::string utc;
    if (wall_ > 0) {
      utc = utc_text(at_second(event.time));
      event.time -= wall_;
    }
    const std::string line = zones::event_line(event, utc);
    if (events_) events_->write(line);
    if (listener_) listener_(line);
  }
}

void ZoneWriter::write_summaries() {
  const auto write = [&](const std::string& path, std::unique_ptr<io::OutputFile>& whole,
                         const auto& content) {
    if (path.empty()) return;
    try {
      if (flowing_) whole = std::make_unique<io::OutputFile>(path);
      const auto bytes = content();
      whole->write(bytes.data(), bytes.size());
      whole->commit();
    } catch (const std::runtime_error& error) {  // a full disk does not end what has no end
      if (!flowing_) throw;
      flowing_->tell(error.what());
    }
  };
  write(files_.counts, counts_, [&] {
    if (wall_ > 0) {
      return zones::counts_table(counter_, [](std::int64_t hour) {
        return utc_text(at_second(3600. * static_cast<double>(hour))).substr(0, 13) + "Z";
      });
    }
    return zones::counts_table(counter_);
  });
  write(files_.heat_map, heat_map_file_,
        [&] { return heat_map_png(heat_map_, counter_.plan().width, counter_.plan().height); });
}

}  // namespace sdmt::pipeline
