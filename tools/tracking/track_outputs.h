// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mqtt/message_writer.h"
#include "report/run_report_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/pipeline/association_log.h"
#include "sdmt/pipeline/track_writers.h"
#include "sdmt/pipeline/zone_writer.h"
#include "serve/camera_view.h"
#include "tracking/track_run.h"

namespace sdmt::tools {

/// Everything that a run leaves behind.
class Outputs {
 public:
  Outputs(const TrackCommand& command, const pipeline::FrameSource& frames, track::Tracker& tracker,
          const Followers& followers)
      : unreadable_([&command](const std::string& text) { command.warn(text); }),
        view_(followers.view) {
    std::optional<pipeline::Flowing> flowing;
    if (frames.live()) {
      flowing = {pipeline::Rotation::parse(command.rotate),
                 [&command](const std::string& text) { command.warn(text); }};
      if (!command.keep.empty()) flowing->keep = command.keep_seconds();
    }
    if (!command.output.empty()) {
      writers_.push_back(pipeline::make_mot_writer(command.output, flowing));
    }
    if (!command.jsonl.empty()) {
      writers_.push_back(pipeline::make_jsonl_writer(
          command.jsonl, pipeline::display_name(command.input), flowing));
    }
    if (!command.render.empty()) {
      writers_.push_back(pipeline::make_video_writer(command.render, command.input, frames,
                                                     unreadable_, flowing, command.blur));
    }
    if (!command.zones.empty()) {
      auto writer = std::make_unique<pipeline::ZoneWriter>(command.zone_plan(frames),
                                                           command.zone_files, flowing);
      if (followers.view != nullptr) {
        writer->tell_events_to([followers](const std::string& line) {
          followers.view->show_event(line);
          if (followers.publisher != nullptr) {
            followers.publisher->send_event(followers.view->name(), line);
          }
        });
      }
      if (flowing) {
        writer->follow(
            command.zones, [&frames] { return frames.picture(); },
            [&command, &frames] { return command.zone_plan(frames); });
      }
      zones_ = writer.get();
      writers_.push_back(std::move(writer));
    }
    if (followers.view != nullptr) {
      writers_.push_back(std::make_unique<ViewWriter>(*followers.view, command.input, frames,
                                                      command.shows_pictures(), command.blur));
    }
    if (followers.publisher != nullptr) {
      writers_.push_back(std::make_unique<MessageWriter>(
          *followers.publisher, followers.view->name(), pipeline::display_name(command.input)));
    }
    if (!command.json.empty()) json_.emplace(command.json);
    if (!command.explain.empty()) explanation_.emplace(command.explain, tracker);
  }

  pipeline::AssociationLog* explanation() { return explanation_ ? &*explanation_ : nullptr; }
  pipeline::UnreadableFrames& unreadable() { return unreadable_; }
  bool need_images() const {
    return std::any_of(writers_.begin(), writers_.end(),
                       [](const auto& writer) { return writer->needs_images(); });
  }
  const pipeline::ZoneWriter* zones() const { return zones_; }
  void read(const pipeline::Frame& frame) {
    for (const auto& writer : writers_) writer->read(frame);
  }
  void write(const track::FinishedFrame& frame, const pipeline::FrameTime& time) {
    for (const auto& writer : writers_) writer->write(frame, time);
    if (view_ != nullptr && zones_ != nullptr) view_->show_zones(zones_->counter());
  }
  void progress(const pipeline::RunReport& report) {
    if (view_ != nullptr) view_->show_stages(report);
  }
  // The video comes last: it is the one that fails on a full disk, and the others are to be kept.
  void commit(const pipeline::RunReport& report) {
    if (explanation_) explanation_->commit();
    if (json_) {
      json_->write(run_report_json(report));
      json_->commit();
    }
    for (const auto& writer : writers_) writer->commit();
  }

 private:
  pipeline::UnreadableFrames unreadable_;
  CameraView* view_;
  std::vector<std::unique_ptr<pipeline::TrackWriter>> writers_;
  const pipeline::ZoneWriter* zones_ = nullptr;  // one of them
  std::optional<io::OutputFile> json_;
  std::optional<pipeline::AssociationLog> explanation_;
};

}  // namespace sdmt::tools
