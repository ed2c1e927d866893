// SPDX-License-Identifier: Apache-2.0
#include "sdmt/pipeline/track_writers.h"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <vector>

#include "sdmt/io/output_file.h"
#include "sdmt/mot/mot_file.h"
#include "sdmt/track/result_rows.h"

namespace sdmt::pipeline {

namespace {

class MotWriter : public TrackWriter {
 public:
  explicit MotWriter(const std::string& path) : file_(path) {}

  void write(const track::FinishedFrame& frame) override {
    rows_.clear();
    track::append_results(frame, rows_);
    for (const mot::ResultRow& row : rows_) file_.write(mot::format_result(row));
  }
  void commit() override { file_.commit(); }

 private:
  io::OutputFile file_;
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
  explicit JsonlWriter(const std::string& path) {
    if (path != "-") file_.emplace(path);
  }

  void write(const track::FinishedFrame& frame) override {
    const std::string line = jsonl_line(frame);
    if (file_) {
      file_->write(line);
    } else if (!deserted_) {
      print(line);
    }
  }
  void commit() override {
    if (file_) file_->commit();
  }

 private:
  void print(const std::string& line) {
    const bool printed =
        std::fwrite(line.data(), 1, line.size(), stdout) == line.size() && std::fflush(stdout) == 0;
    if (printed) return;
    // SIGPIPE came with it and ends the run; the other outputs must still become whole.
    deserted_ = errno == EPIPE;
    if (deserted_) return;
    throw std::runtime_error(std::string("standard output: write failed: ") + std::strerror(errno));
  }

  std::optional<io::OutputFile> file_;  // empty: standard output
  bool deserted_ = false;               // nobody reads standard output any more
};

}  // namespace

std::unique_ptr<TrackWriter> make_mot_writer(const std::string& path) {
  return std::make_unique<MotWriter>(path);
}

std::unique_ptr<TrackWriter> make_jsonl_writer(const std::string& path) {
  return std::make_unique<JsonlWriter>(path);
}

}  // namespace sdmt::pipeline
