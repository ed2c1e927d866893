// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/track_writers.h"

#include <fmt/core.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "sdmt/mot/mot_file.h"
#include "sdmt/pipeline/utc_time.h"
#include "sdmt/track/result_rows.h"

namespace sdmt::pipeline {

namespace {

class MotWriter : public TrackWriter {
 public:
  MotWriter(const std::string& path, const std::optional<Flowing>& flowing)
      : file_(open_line_output(path, flowing)) {}

  void write(const track::FinishedFrame& frame, const FrameTime&) override {
    rows_.clear();
    track::append_results(frame, rows_);
    std::string lines;
    for (const mot::ResultRow& row : rows_) lines += mot::format_result(row);
    if (!lines.empty()) file_->write(lines);
  }
  void commit() override { file_->commit(); }

 private:
  std::unique_ptr<LineOutput> file_;
  std::vector<mot::ResultRow> rows_;
};

class JsonlWriter : public TrackWriter {
 public:
  JsonlWriter(const std::string& path, std::string source, const std::optional<Flowing>& flowing)
      : file_(open_line_output(path, flowing)), source_(std::move(source)) {}

  void write(const track::FinishedFrame& frame, const FrameTime& time) override {
    file_->write(finished_frame_line(source_, frame, time));
  }
  void commit() override { file_->commit(); }

 private:
  std::unique_ptr<LineOutput> file_;
  std::string source_;
};

}  // namespace

std::string finished_frame_line(const std::string& source, const track::FinishedFrame& frame,
                                const FrameTime& time) {
  std::string line = fmt::format(
      "{{\"version\":1,\"source\":{},\"frame\":{},",
      nlohmann::json(source).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
      frame.frame);
  const auto out = std::back_inserter(line);
  if (time.time) fmt::format_to(out, "\"time\":{:.3f},", *time.time);
  if (time.wall_clock) fmt::format_to(out, "\"utc\":\"{}\",", utc_text(*time.wall_clock));
  line += "\"tracks\":[";
  const char* separator = "";
  for (const track::TrackedBox& box : frame.boxes) {
    fmt::format_to(out,
                   "{}{{\"id\":{},\"box\":[{:.2f},{:.2f},{:.2f},{:.2f}],"
                   "\"score\":{:.4g},"
                   "\"source\":\"{}\"}}",
                   separator, box.id, box.box.left, box.box.top, box.box.width, box.box.height,
                   box.score, track::to_string(box.source));
    separator = ",";
  }
  line += "],\"merges\":[";
  separator = "";
  for (const track::IdMerge& merge : frame.merges) {
    fmt::format_to(out, "{}{{\"from\":{},\"to\":{}}}", separator, merge.from, merge.to);
    separator = ",";
  }
  line += "]}\n";
  return line;
}

std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path,
                                             const std::optional<Flowing>& flowing) {
  return std::make_unique<MotWriter>(path, flowing);
}

std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path, const std::string& source,
                                               const std::optional<Flowing>& flowing) {
  return std::make_unique<JsonlWriter>(path, source, flowing);
}

}  // namespace sdmt::pipeline
