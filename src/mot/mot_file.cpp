// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/mot_file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/output_file.h"
#include "sdmt/mot/class_filter.h"

namespace sdmt::mot {

namespace {

constexpr int kAnyNumber = std::numeric_limits<int>::min();

Tlwh read_box(io::NumberLine& line, bool allow_empty) {
  Tlwh box;
  box.left = line.number("left");
  box.top = line.number("top");
  box.width = line.number("width");
  box.height = line.number("height");
  const auto check = [&](const char* column, double size) {
    if (allow_empty ? size < 0 : size <= 0) line.refuse(column, size, allow_empty ? ">= 0" : "> 0");
  };
  check("width", box.width);
  check("height", box.height);
  return box;
}

// What the tracker takes; refused here, where the line is known.
void check_range(const io::NumberLine& line, const Tlwh& box) {
  const auto check = [&](const char* column, double value) {
    if (std::abs(value) > kFarthest) line.refuse(column, value, "-1e12..1e12");
  };
  check("left", box.left);
  check("top", box.top);
  check("width", box.width);
  check("height", box.height);
}

// The class that a text stands for, -1 for none.
int class_of(std::string_view text) {
  constexpr double kMostClasses = 1000;
  const auto value = io::parse_number<double>(text);
  const bool is_class =
      value && *value >= 0 && *value < kMostClasses && *value == std::floor(*value);
  return is_class ? static_cast<int>(*value) : -1;
}

template <typename Row>
void sort_by_frame(std::vector<Row>& rows) {
  const auto by_frame = [](const Row& a, const Row& b) { return a.frame < b.frame; };
  if (!std::is_sorted(rows.begin(), rows.end(), by_frame)) {
    std::stable_sort(rows.begin(), rows.end(), by_frame);
  }
}

// The line, with commas where it has only blanks between its columns.
std::string comma_separated(std::string_view line) {
  std::string text(line);
  if (line.find(',') != std::string_view::npos || line.find(';') != std::string_view::npos) {
    return text;
  }
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  text.erase(
      std::unique(text.begin(), text.end(), [&](char a, char b) { return blank(a) && blank(b); }),
      text.end());
  std::replace_if(text.begin(), text.end(), blank, ',');
  return text;
}

// Calls read(NumberLine&) for each line and returns the rows sorted by frame, else in file order.
template <typename Row, typename Read>
std::vector<Row> read_rows(const std::filesystem::path& path, Read&& read) {
  std::vector<Row> rows;
  io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view text) {
    io::NumberLine line(path, number, text);
    rows.push_back(read(line));
  });
  sort_by_frame(rows);
  return rows;
}

}  // namespace

DetectionFile DetectionFile::read(const std::filesystem::path& path, int frame_offset,
                                  const ClassFilter* classes) {
  struct Read {
    int columns = 0;
    bool has_classes = true;
    std::map<int, std::size_t> classes;
  } seen;
  std::size_t unwanted = 0;
  std::vector<DetectionRow> rows;
  io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view raw) {
    const std::string text = comma_separated(raw);
    io::NumberLine line(path, number, text);
    const int columns = line.columns();
    seen.columns = std::max(seen.columns, columns);
    try {
      DetectionRow row;
      row.frame = line.whole("frame", 1 - frame_offset) + frame_offset;
      line.whole("id", kAnyNumber);
      row.detection.box = read_box(line, false);
      check_range(line, row.detection.box);
      row.detection.score = line.number("score");
      const int category = line.more() ? class_of(line.text("class")) : -1;
      if (classes != nullptr && !classes->wants(category, "")) {
        ++unwanted;
        return;
      }
      seen.has_classes = seen.has_classes && category >= 0;
      if (seen.has_classes) ++seen.classes[category];
      rows.push_back(std::move(row));
    } catch (const std::invalid_argument& error) {
      if (columns <= kMostColumns) throw;
      throw std::invalid_argument(error.what() + std::string("; the line has ") +
                                  std::to_string(columns) +
                                  " columns, expected 7 to 10 (decimals take a point)");
    }
  });
  if (rows.empty() && unwanted > 0) {
    throw std::invalid_argument(path.string() + ": no box has a wanted class (" + classes->text() +
                                ") in the eighth column; MOT files number their classes");
  }
  DetectionFile file = from_rows(std::move(rows), path.string());
  file.columns_ = seen.columns;
  if (seen.has_classes) file.classes_ = std::move(seen.classes);
  return file;
}

DetectionFile DetectionFile::from_rows(std::vector<DetectionRow> rows, const std::string& name) {
  sort_by_frame(rows);
  // Whoever goes from frame to frame must not go on for ever for one absurd number.
  constexpr int kLargestGap = 10'000'000;
  DetectionFile file;
  file.detections_.reserve(rows.size());
  if (!rows.empty()) file.dimension_ = static_cast<int>(rows.front().embedding.size());
  for (const DetectionRow& row : rows) {
    if (row.frame - file.last_frame() > kLargestGap) {
      throw std::invalid_argument(name + ": frame " + std::to_string(row.frame) +
                                  " follows frame " + std::to_string(file.last_frame()) +
                                  ", expected at most 10000000 frames between");
    }
    if (row.frame != file.last_frame()) {
      file.frames_.push_back(row.frame);
      file.first_.push_back(file.detections_.size());
    }
    file.detections_.push_back(row.detection);
    file.embeddings_.insert(file.embeddings_.end(), row.embedding.begin(), row.embedding.end());
  }
  return file;
}

std::pair<std::size_t, std::size_t> DetectionFile::range(int frame) const {
  const auto found = std::lower_bound(frames_.begin(), frames_.end(), frame);
  if (found == frames_.end() || *found != frame) return {0, 0};
  const auto i = found - frames_.begin();
  const bool last = found + 1 == frames_.end();
  const std::size_t end = last ? detections_.size() : first_[i + 1];
  return {first_[i], end - first_[i]};
}

std::span<const Detection> DetectionFile::frame(int frame) const {
  const auto [first, count] = range(frame);
  return std::span(detections_).subspan(first, count);
}

std::optional<double> DetectionFile::time(int frame) const {
  const auto found = times_.find(frame);
  return found == times_.end() ? std::nullopt : std::optional(found->second);
}

std::span<const float> DetectionFile::embeddings(int frame) const {
  const auto [first, count] = range(frame);
  return std::span(embeddings_).subspan(first * dimension_, count * dimension_);
}

bool DetectionFile::has_scores() const {
  return std::any_of(detections_.begin(), detections_.end(), [this](const Detection& detection) {
    return detection.score != detections_.front().score;
  });
}

std::vector<GroundTruthRow> read_ground_truth(const std::filesystem::path& path) {
  return read_rows<GroundTruthRow>(path, [](io::NumberLine& line) {
    GroundTruthRow row;
    row.frame = line.whole("frame", 1);
    row.id = line.whole("id", kAnyNumber);
    row.box = read_box(line, true);
    row.keep = line.number("flag") != 0;
    // MOT15 has world coordinates here, three of them; later benchmarks class and visibility.
    if (line.more()) {
      const double category = line.number("class");
      const double visibility = line.more() ? line.number("visibility") : 1;
      if (!line.more() && category >= 1 && category == std::floor(category)) {
        row.category = static_cast<int>(std::min(category, 1e9));
        row.visibility = visibility;
      }
    }
    return row;
  });
}

std::vector<ResultRow> read_results(const std::filesystem::path& path, RowsBeforeFrame1 early) {
  const bool drop = early == RowsBeforeFrame1::drop;
  auto rows = read_rows<ResultRow>(path, [drop](io::NumberLine& line) {
    ResultRow row;
    row.frame = line.whole("frame", drop ? kAnyNumber : 1);
    row.id = line.whole("id", kAnyNumber);
    row.box = read_box(line, true);
    if (line.more()) row.confidence = line.number("confidence");
    if (line.more()) row.category = static_cast<int>(std::clamp(line.number("class"), -1e9, 1e9));
    return row;
  });
  const auto first =
      std::find_if(rows.begin(), rows.end(), [](const ResultRow& row) { return row.frame >= 1; });
  rows.erase(rows.begin(), first);
  return rows;
}

std::string format_result(const ResultRow& row) {
  // Wide enough for any double in %.2f (310 digits each).
  char text[1400];
  const int length = std::snprintf(text, sizeof text, "%d,%d,%.2f,%.2f,%.2f,%.2f,%.6g,-1,-1,-1\n",
                                   row.frame, row.id, row.box.left, row.box.top, row.box.width,
                                   row.box.height, row.confidence);
  return std::string(text, length);
}

void write_results(const std::filesystem::path& path, std::span<const ResultRow> rows) {
  io::OutputFile file(path);
  for (const ResultRow& row : rows) file.write(format_result(row));
  file.commit();
}

}  // namespace sdmt::mot
