// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/track_writers.h"

#include <fmt/core.h>

#include <iterator>
#include <string_view>
#include <vector>

#include "sdmt/io/output_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/track/result_rows.h"

namespace sdmt::pipeline {

namespace {

// A file of results, or standard output ("-"), where each frame is to be seen at once.
class ResultFile {
 public:
  explicit ResultFile(const std::string& path) : file_(path), live_(path == "-") {}

  void write(std::string_view text) {
    if (deserted_) return;
    try {
      file_.write(text);
      if (live_) file_.flush();
    } catch (const io::ReaderLeft&) {
      // SIGPIPE came with it and ends the run; the other outputs must still become whole.
      deserted_ = true;
    }
  }
  void commit() {
    if (!deserted_) file_.commit();
  }

 private:
  io::OutputFile file_;
  bool live_;
  bool deserted_ = false;
};

class MotWriter : public TrackWriter {
 public:
  explicit MotWriter(const std::string& path) : file_(path) {}

  void write(const track::FinishedFrame& frame) override {
    rows_.clear();
    track::append_results(frame, rows_);
    std::string text;
    for (const mot::ResultRow& row : rows_) text += mot::format_result(row);
    file_.write(text);
  }
  void commit() override { file_.commit(); }

 private:
  ResultFile file_;
  std::vector<mot::ResultRow> rows_;
};

std::string jsonl_line(const track::FinishedFrame& frame) {
  std::string line;
  const auto out = std::back_inserter(line);
  fmt::format_to(out, "{{\"frame\":{},\"tracks\":[", frame.frame);
  const char* separator = "";
  for (const track::TrackedBox& box : frame.boxes) {
    fmt::format_to(out,
                   "{}{{\"id\":{},\"box\":[{:.2f},{:.2f},{:.2f},{:.2f}],\"score\":{:.4g},"
                   "\"source\":\"{}\"}}",
                   separator, box.id, box.box.left, box.box.top, box.box.width, box.box.height,
                   box.score, track::to_string(box.source));
    separator = ",";
  }
  fmt::format_to(out, "],\"merges\":[");
  separator = "";
  for (const track::IdMerge& merge : frame.merges) {
    fmt::format_to(out, "{}{{\"from\":{},\"to\":{}}}", separator, merge.from, merge.to);
    separator = ",";
  }
  fmt::format_to(out, "]}}\n");
  return line;
}

class JsonlWriter : public TrackWriter {
 public:
  explicit JsonlWriter(const std::string& path) : file_(path) {}

  void write(const track::FinishedFrame& frame) override { file_.write(jsonl_line(frame)); }
  void commit() override { file_.commit(); }

 private:
  ResultFile file_;
};

}  // namespace

std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path) {
  return std::make_unique<MotWriter>(path);
}

std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path) {
  return std::make_unique<JsonlWriter>(path);
}

}  // namespace sdmt::pipeline
