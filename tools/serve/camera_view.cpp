// SPDX-License-Identifier: Apache-2.0
#include "serve/camera_view.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "sdmt/media/image_file.h"
#include "sdmt/pipeline/frame_replay.h"
#include "sdmt/pipeline/people_blur.h"
#include "sdmt/pipeline/track_renderer.h"
#include "sdmt/pipeline/utc_time.h"

namespace sdmt::tools {

namespace {

// As Prometheus wants it between double quotes.
std::string label_value(const std::string& text) {
  std::string value;
  for (const char c : text) {
    if (c == '\\' || c == '"') value += '\\';
    if (c == '\n') {
      value += "\\n";
    } else {
      value += c;
    }
  }
  return value;
}

}  // namespace

std::string CameraView::state() const {
  const std::lock_guard lock(mutex_);
  nlohmann::ordered_json state{{"camera", name_},
                               {"running", running_},
                               {"frame", frame_.frame},
                               {"pictures", has_pictures()}};
  if (time_.time) state["time"] = *time_.time;
  if (time_.wall_clock) state["utc"] = pipeline::utc_text(*time_.wall_clock);
  state["people"] = nlohmann::json::array();
  for (const track::TrackedBox& box : frame_.boxes) {
    state["people"].push_back(
        {{"id", box.id}, {"box", {box.box.left, box.box.top, box.box.width, box.box.height}}});
  }
  state["most_people"] = most_;
  state["people_so_far"] = largest_id_;
  if (frames_ > 0) {
    const std::chrono::duration<double> silent = std::chrono::steady_clock::now() - shown_;
    state["silent"] = std::round(silent.count() * 100) / 100;
  }
  if (live_) {
    state["received"] = live_->received;
    state["dropped"] = live_->dropped;
    state["garbled"] = live_->garbled;
    state["losses"] = live_->losses;
    state["lag"] = live_->lag;
  }
  if (!plan_.lines.empty() || !plan_.areas.empty()) {
    auto& zones = state["zones"] = nlohmann::json::array();
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      zones.push_back(
          {{"zone", plan_.lines[i].name}, {"in", lines_[i].in}, {"out", lines_[i].out}});
    }
    for (std::size_t i = 0; i < areas_.size(); ++i) {
      zones.push_back({{"zone", plan_.areas[i].name},
                       {"stays", areas_[i].stays},
                       {"inside", areas_[i].inside},
                       {"most_inside", areas_[i].most_inside},
                       {"mean_dwell", areas_[i].mean_dwell()}});
    }
    state["event_count"] = event_count_;
    auto& events = state["events"] = nlohmann::json::array();
    for (const std::string& event : events_) {
      events.push_back(nlohmann::ordered_json::parse(event));
    }
  }
  return state.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string CameraView::metrics() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  const auto line = [&](const char* metric, double value) {
    text += fmt::format("sdmt_{}{{camera=\"{}\"}} {}\n", metric, name_, value);
  };
  const auto labelled = [&](const char* metric, const char* label, const std::string& name,
                            double value, const char* more = "") {
    text += fmt::format("sdmt_{}{{camera=\"{}\",{}=\"{}\"{}}} {}\n", metric, name_, label,
                        label_value(name), more, value);
  };
  line("running", running_ ? 1 : 0);
  line("frames_total", static_cast<double>(frames_));
  line("people", static_cast<double>(frame_.boxes.size()));
  line("people_total", largest_id_);
  if (live_) {
    line("frames_received_total", static_cast<double>(live_->received));
    line("frames_dropped_total", static_cast<double>(live_->dropped));
    line("frames_garbled_total", static_cast<double>(live_->garbled));
    line("losses_total", static_cast<double>(live_->losses));
    line("lag_seconds", live_->lag);
  }
  for (const auto& [stage, seconds] : stages_) {
    labelled("stage_seconds_total", "stage", stage, seconds);
  }
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const auto cross = [&](const char* direction, std::int64_t count) {
      labelled("zone_crossings_total", "zone", plan_.lines[i].name, static_cast<double>(count),
               direction);
    };
    cross(",direction=\"in\"", lines_[i].in);
    cross(",direction=\"out\"", lines_[i].out);
  }
  for (std::size_t i = 0; i < areas_.size(); ++i) {
    const std::string& name = plan_.areas[i].name;
    labelled("zone_stays_total", "zone", name, static_cast<double>(areas_[i].stays));
    labelled("zone_people", "zone", name, areas_[i].inside);
    labelled("zone_dwell_seconds_total", "zone", name, areas_[i].dwell);
  }
  return text;
}

std::vector<std::uint8_t> CameraView::picture(std::int64_t& after) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::seconds(1), [&] { return pictures_ > after || !running_; });
  if (pictures_ <= after) return {};
  after = pictures_;
  return picture_;
}

std::vector<std::uint8_t> CameraView::next_picture() const {
  std::int64_t after = 0;
  {
    const std::lock_guard lock(mutex_);
    after = pictures_;
  }
  auto jpeg = picture(after);
  return jpeg.empty() ? picture(after) : jpeg;
}

bool CameraView::is_running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

void CameraView::show(const track::FinishedFrame& frame, const pipeline::FrameTime& time,
                      const std::optional<pipeline::LiveCounts>& live) {
  const std::lock_guard lock(mutex_);
  frame_ = frame;
  time_ = time;
  live_ = live;
  shown_ = std::chrono::steady_clock::now();
  ++frames_;
  most_ = std::max(most_, static_cast<int>(frame.boxes.size()));
  for (const track::TrackedBox& box : frame.boxes) largest_id_ = std::max(largest_id_, box.id);
}

void CameraView::show_picture(std::vector<std::uint8_t> jpeg) {
  const std::lock_guard lock(mutex_);
  picture_ = std::move(jpeg);
  ++pictures_;
  changed_.notify_all();
}

void CameraView::show_zones(const zones::ZoneCounter& counter) {
  const std::lock_guard lock(mutex_);
  plan_ = counter.plan();
  lines_ = counter.lines();
  areas_ = counter.areas();
}

void CameraView::show_event(const std::string& line) {
  constexpr std::size_t kEvents = 20;
  const std::lock_guard lock(mutex_);
  ++event_count_;
  events_.push_back(line);
  if (events_.size() > kEvents) events_.pop_front();
}

void CameraView::show_stages(const pipeline::RunReport& report) {
  const track::TrackerStats& stats = report.stats;
  const std::lock_guard lock(mutex_);
  stages_ = {{"detect", report.detect_seconds}, {"predict", stats.predict_seconds},
             {"embed", stats.embed_seconds},    {"assign", stats.assign_seconds},
             {"boost", stats.boost_seconds},    {"associate", stats.associate_seconds},
             {"emit", stats.emit_seconds}};
}

void CameraView::end() {
  const std::lock_guard lock(mutex_);
  running_ = false;
  changed_.notify_all();
}

struct ViewWriter::Pictures {
  pipeline::FrameReplay replay;
  pipeline::TrackRenderer renderer;
  std::chrono::steady_clock::time_point last;

  // Ten a second are enough.
  bool is_due() {
    constexpr std::chrono::milliseconds kBetweenPictures{100};
    const auto now = std::chrono::steady_clock::now();
    if (now - last < kBetweenPictures) return false;
    last = now;
    return true;
  }
};

ViewWriter::ViewWriter(CameraView& view, const std::string& input,
                       const pipeline::FrameSource& source, bool pictures, bool blur)
    : view_(view), source_(source), blur_(blur) {
  view.set_pictures(pictures && source.has_images());
  if (view.has_pictures()) {
    pictures_ = std::make_unique<Pictures>(Pictures{pipeline::FrameReplay(input, source), {}, {}});
  }
}

ViewWriter::~ViewWriter() { view_.end(); }

bool ViewWriter::needs_images() const {
  return pictures_ != nullptr && pictures_->replay.keeps_images();
}

void ViewWriter::read(const pipeline::Frame& frame) {
  if (needs_images()) pictures_->replay.add(frame, pictures_->is_due());
}

void ViewWriter::write(const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
  view_.show(frame, time, source_.live());
  if (pictures_ == nullptr) return;
  constexpr int kQuality = 80;
  auto& replay = pictures_->replay;
  // Of those that were kept each is due.
  if (!view_.is_watched() || !replay.has_next_image() ||
      (!replay.keeps_images() && !pictures_->is_due())) {
    replay.skip();
    pictures_->renderer.skip(frame);
    return;
  }
  pipeline::Frame picture = replay.next();
  if (blur_) pipeline::blur_people(frame, picture.image);
  pictures_->renderer.draw(frame, picture.image);
  view_.show_picture(media::encode_jpeg(picture.image, kQuality));
}

}  // namespace sdmt::tools
