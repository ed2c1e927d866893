// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/detection_formats.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <span>
#include <stdexcept>

#include "box_collector.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::mot {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::pair<std::string_view, DetectionFormat>, 6> kNames{
    {{"mot", DetectionFormat::mot},
     {"csv", DetectionFormat::csv},
     {"jsonl", DetectionFormat::json_lines},
     {"kitti", DetectionFormat::kitti},
     {"coco", DetectionFormat::coco},
     {"yolo", DetectionFormat::yolo}}};

bool has_letters(std::string_view cell) {
  return std::any_of(cell.begin(), cell.end(),
                     [](unsigned char c) { return std::isalpha(c) != 0 && c != 'e' && c != 'E'; });
}

// The cells of a line between blanks.
std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> found;
  while (true) {
    const auto begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return found;
    line.remove_prefix(begin);
    const auto end = std::min(line.find_first_of(" \t"), line.size());
    found.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

// What to say of a line with as many columns as YOLO's labels have: class cx cy width height
// [score], all but the class fractions of the picture; nullopt of any other line.
std::optional<std::string> describe_yolo_label(std::span<const std::string_view> cells) {
  constexpr std::size_t kFewest = 5, kMost = 6;
  constexpr double kSlack = 0.5;  // boxes may leave the picture
  if (cells.size() < kFewest || cells.size() > kMost) return std::nullopt;
  if (!io::parse_number<int>(cells[0])) return std::nullopt;
  bool fractions = true;
  for (const std::string_view cell : cells.subspan(1)) {
    const auto number = io::parse_number<double>(cell);
    if (!number) return std::nullopt;
    if (*number < -kSlack || *number > 1 + kSlack) fractions = false;
  }
  if (fractions) {
    return "looks like YOLO's labels of one picture, expected the folder that holds such a file "
           "for each frame (or name its format with --detections-format)";
  }
  return "has " + std::to_string(cells.size()) +
         " columns, as YOLO's labels do, but they are no fractions of the picture; expected a "
         "folder of such labels, or rows frame,-1,left,top,width,height,score";
}

}  // namespace

std::optional<DetectionFormat> parse_detection_format(std::string_view name) {
  for (const auto& [known, format] : kNames) {
    if (name == known) return format;
  }
  return std::nullopt;
}

DetectionFormat recognise_format(const fs::path& path) {
  std::error_code failed;
  if (fs::is_directory(path, failed)) return DetectionFormat::yolo;
  const std::string text = io::read_text(path);
  std::string_view first;
  std::size_t objects = 0;  // lines that begin one of JSON's
  io::for_each_line(text, [&](std::size_t, std::string_view line) {
    if (first.empty()) first = line;
    if (line.starts_with('{')) ++objects;
  });
  if (std::any_of(first.begin(), first.end(),
                  [](unsigned char c) { return c < ' ' && c != '\t'; })) {
    throw std::invalid_argument(path.string() +
                                ": is no text, expected boxes in a format of --detections-format");
  }
  if (first.starts_with('[')) return DetectionFormat::coco;
  if (first.starts_with('{')) {
    const bool a_frame = objects > 1 || first.find("\"boxes\"") != std::string_view::npos;
    return first.ends_with('}') && a_frame ? DetectionFormat::json_lines : DetectionFormat::coco;
  }
  constexpr std::size_t kKittiColumns = 10;
  const auto cells = words(first);
  const bool commas = first.find(',') != std::string_view::npos;
  if (!commas && cells.size() >= kKittiColumns && has_letters(cells[2])) {
    return DetectionFormat::kitti;
  }
  if (const auto label = commas ? std::nullopt : describe_yolo_label(cells)) {
    throw std::invalid_argument(path.string() + ": " + *label);
  }
  return has_letters(first.substr(0, first.find_first_of(",;\t"))) ? DetectionFormat::csv
                                                                   : DetectionFormat::mot;
}

DetectionFile read_detections(const fs::path& path, const DetectionReading& reading) {
  switch (reading.format ? *reading.format : recognise_format(path)) {
    case DetectionFormat::csv:
      return read_csv(path, reading);
    case DetectionFormat::json_lines:
      return read_json_lines(path, reading);
    case DetectionFormat::kitti:
      return read_kitti(path, reading);
    case DetectionFormat::coco:
      return read_coco(path, reading);
    case DetectionFormat::yolo:
      return read_yolo(path, reading);
    case DetectionFormat::mot:
      break;
  }
  return DetectionFile::read(path, reading.frame_offset,
                             reading.classes ? &*reading.classes : nullptr);
}

DetectionFile BoxCollector::finish(const std::string& file) && {
  if (rows_.empty() && !unwanted_.empty()) {
    std::string list;
    for (const auto& [name, count] : unwanted_) {
      list += (list.empty() ? "" : ", ") + name + " (" + std::to_string(count) + ")";
    }
    throw std::invalid_argument(file + ": no box is of a wanted class, expected " +
                                classes_.text() + "; there are " + io::printable(list, 200) +
                                ", choose with --classes");
  }
  return DetectionFile::from_rows(std::move(rows_), file);
}

int offset_frame(long long frame, int offset, const std::string& where) {
  const long long moved = frame + offset;
  if (moved < 1) {
    throw std::invalid_argument(where + ": frame is " + std::to_string(moved) +
                                ", expected >= 1 (--frame-offset is added to it)");
  }
  if (moved > std::numeric_limits<int>::max()) {
    throw std::invalid_argument(where + ": frame is " + std::to_string(moved) +
                                ", expected <= 2147483647");
  }
  return static_cast<int>(moved);
}

std::optional<long long> number_of_name(const fs::path& name) {
  constexpr std::size_t kMostDigits = 15;
  const std::string stem = name.stem().string();
  const auto last = stem.find_last_not_of("0123456789");
  const std::string digits = last == std::string::npos ? stem : stem.substr(last + 1);
  if (digits.empty() || digits.size() > kMostDigits) return std::nullopt;
  return io::parse_number<long long>(digits);
}

}  // namespace sdmt::mot
