// SPDX-License-Identifier: Apache-2.0
// Boxes in lines of text: CSV with a header, KITTI, YOLO.
#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>

#include "box_collector.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::mot {

namespace fs = std::filesystem;

namespace {

// The line with a comma in place of each of `separators`, or of each run of them.
std::string with_commas(std::string_view line, std::string_view separators, bool runs) {
  std::string out;
  for (const char c : line) {
    if (separators.find(c) == std::string_view::npos) {
      out += c;
    } else if (!runs || out.empty() || out.back() != ',') {
      out += ',';
    }
  }
  return out;
}

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells;
  while (true) {
    const auto comma = line.find(',');
    std::string_view cell = line.substr(0, comma);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '"')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '"')) cell.remove_suffix(1);
    cells.emplace_back(cell);
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

enum Column { kFrame, kLeft, kTop, kWidth, kHeight, kRight, kBottom, kScore, kClass, kColumns };

// The names under which columns are known, in lower case.
const std::array<std::vector<std::string>, kColumns> kColumnNames{
    {{"frame", "frame_id", "frame_number", "frame_index", "image_id"},
     {"left", "x", "x1", "xmin", "x_min", "bb_left", "bbox_left"},
     {"top", "y", "y1", "ymin", "y_min", "bb_top", "bbox_top"},
     {"width", "w", "bb_width", "bbox_width"},
     {"height", "h", "bb_height", "bbox_height"},
     {"right", "x2", "xmax", "x_max", "bb_right", "bbox_right"},
     {"bottom", "y2", "ymax", "y_max", "bb_bottom", "bbox_bottom"},
     {"score", "conf", "confidence", "prob", "probability"},
     {"class", "label", "category", "class_name", "class_id", "category_id"}}};

// Where each column stands in the header; -1 where it does not.
std::array<int, kColumns> find_columns(const fs::path& path, std::string_view header) {
  std::array<int, kColumns> at;
  at.fill(-1);
  const auto cells = cells_of(header);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    std::string name = cells[i];
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (int column = 0; column < kColumns; ++column) {
      const auto& names = kColumnNames[column];
      if (std::find(names.begin(), names.end(), name) != names.end())
        at[column] = static_cast<int>(i);
    }
  }
  const auto need = [&](Column column, Column instead) {
    if (at[column] >= 0 || at[instead] >= 0) return;
    const std::string other =
        column == instead ? "" : " or '" + kColumnNames[instead].front() + "'";
    throw std::invalid_argument(path.string() + ":1: the header has no column '" +
                                kColumnNames[column].front() + "'" + other + ": " +
                                io::quoted(header));
  };
  need(kFrame, kFrame);
  need(kLeft, kLeft);
  need(kTop, kTop);
  need(kWidth, kRight);
  need(kHeight, kBottom);
  return at;
}

// A class as a cell has it: a number, whose name may be known, or a name.
void add(BoxCollector& boxes, int frame, const Detection& detection, std::string_view category,
         std::span<const std::string> names) {
  const auto number = io::parse_number<int>(category);
  if (!number) {
    boxes.add(frame, detection, -1, category);
  } else if (names.empty()) {
    boxes.add(frame, detection, *number, coco_class_name(*number));
  } else {
    const bool known = *number >= 0 && *number < static_cast<int>(names.size());
    boxes.add(frame, detection, *number, known ? std::string_view(names[*number]) : "");
  }
}

}  // namespace

DetectionFile read_csv(const fs::path& path, const DetectionReading& reading) {
  BoxCollector boxes(reading);
  std::array<int, kColumns> at{};
  bool header = true;
  const std::string text = io::read_text(path);
  // Semicolons and tabs; where there are some, a comma in a number is what its message shows.
  const std::string_view separators = ";\t";
  io::for_each_line(text, [&](std::size_t number, std::string_view raw) {
    const std::string line = with_commas(raw, separators, false);
    if (header) {
      header = false;
      at = find_columns(path, line);
      return;
    }
    const auto cells = cells_of(line);
    const auto value = [&](Column column) {
      if (at[column] >= static_cast<int>(cells.size())) {
        throw std::invalid_argument(path.string() + ":" + std::to_string(number) + ": " +
                                    kColumnNames[column].front() + " is missing");
      }
      const std::string& cell = cells[at[column]];
      io::NumberLine one(path, number, cell);
      return one.number(kColumnNames[column].front().c_str());
    };
    const io::NumberLine place(path, number, line);
    const double frame = value(kFrame);
    if (frame != static_cast<double>(static_cast<long long>(frame))) {
      place.refuse("frame", frame, "a whole number");
    }
    Detection detection;
    Tlwh& box = detection.box;
    box.left = value(kLeft);
    box.top = value(kTop);
    box.width = at[kWidth] >= 0 ? value(kWidth) : value(kRight) - box.left;
    box.height = at[kHeight] >= 0 ? value(kHeight) : value(kBottom) - box.top;
    check_box(box, [&](auto... what) { place.refuse(what...); });
    if (at[kScore] >= 0) detection.score = value(kScore);
    const int moved = offset_frame(static_cast<long long>(frame), reading.frame_offset,
                                   path.string() + ":" + std::to_string(number));
    if (at[kClass] < 0) {
      boxes.add(moved, detection, -1, "person");
    } else if (at[kClass] < static_cast<int>(cells.size())) {
      add(boxes, moved, detection, cells[at[kClass]], {});
    } else {
      throw std::invalid_argument(path.string() + ":" + std::to_string(number) +
                                  ": class is missing");
    }
  });
  return std::move(boxes).finish(path.string());
}

// frame, track, type, truncated, occluded, alpha, left, top, right, bottom, height, width, length,
// x, y, z, rotation [, score].
DetectionFile read_kitti(const fs::path& path, const DetectionReading& reading) {
  BoxCollector boxes(reading);
  io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view raw) {
    const std::string text = with_commas(raw, " \t", true);
    io::NumberLine line(path, number, text);
    const int frame = line.whole("frame", -1'000'000);
    line.number("track");
    const std::string type(line.text("type"));
    for (const char* column : {"truncated", "occluded", "alpha"}) line.number(column);
    Detection detection;
    Tlwh& box = detection.box;
    box.left = line.number("left") + 1;
    box.top = line.number("top") + 1;
    box.width = line.number("right") + 1 - box.left;
    box.height = line.number("bottom") + 1 - box.top;
    check_box(box, [&](auto... what) { line.refuse(what...); });
    for (const char* column : {"height", "width", "length", "x", "y", "z", "rotation"}) {
      if (line.more()) line.number(column);
    }
    if (line.more()) detection.score = line.number("score");
    if (type == "DontCare") return;
    boxes.add(offset_frame(frame + 1LL, reading.frame_offset,
                           path.string() + ":" + std::to_string(number)),
              detection, -1, type);
  });
  return std::move(boxes).finish(path.string());
}

DetectionFile read_yolo(const fs::path& given, const DetectionReading& reading) {
  if (!fs::is_directory(given)) {
    throw std::invalid_argument(given.string() +
                                ": is no folder, expected the one that holds a text file for each "
                                "frame (yolo)");
  }
  if (reading.width < 1 || reading.height < 1) {
    throw std::invalid_argument(given.string() +
                                ": YOLO's boxes are fractions of the picture, whose size is not "
                                "known; state it in seqinfo.ini (imWidth, imHeight)");
  }
  const auto is_text = [](const fs::path& path) {
    return path.extension() == ".txt" && path.filename() != "classes.txt" &&
           !path.filename().string().starts_with('.');
  };
  const auto texts_in = [&](const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (is_text(entry.path())) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
  };
  fs::path folder = given;
  if (texts_in(folder).empty() && fs::is_directory(folder / "labels")) folder /= "labels";
  const auto files = texts_in(folder);
  if (files.empty()) {
    throw std::invalid_argument(given.string() +
                                ": holds no .txt, expected one a frame (YOLO's format)");
  }
  std::vector<std::string> names;
  for (const auto& list : {folder / "classes.txt", folder.parent_path() / "classes.txt"}) {
    if (!names.empty() || !fs::exists(list)) continue;
    io::for_each_line(io::read_text(list),
                      [&](std::size_t, std::string_view line) { names.emplace_back(line); });
  }
  BoxCollector boxes(reading);
  for (const auto& path : files) {
    const auto said = number_of_name(path);
    if (!said) {
      throw std::invalid_argument(path.string() +
                                  ": the name ends with no frame number, expected 000001.txt");
    }
    const int frame = offset_frame(*said, reading.frame_offset, path.string());
    io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view raw) {
      const std::string text = with_commas(raw, " \t", true);
      io::NumberLine line(path, number, text);
      const std::string category = std::to_string(line.whole("class", 0));
      const auto fraction = [&](const char* column) {
        const double value = line.number(column);
        constexpr double kSlack = 0.5;  // boxes may leave the picture
        if (value < -kSlack || value > 1 + kSlack) {
          line.refuse(column, value, "a fraction of the picture, 0..1");
        }
        return value;
      };
      const double cx = fraction("cx"), cy = fraction("cy");
      const double width = fraction("width"), height = fraction("height");
      Detection detection;
      detection.box = to_tlwh({cx * reading.width + 1, cy * reading.height + 1,
                               width * reading.width, height * reading.height});
      check_box(detection.box, [&](auto... what) { line.refuse(what...); });
      if (line.more()) detection.score = line.number("score");
      add(boxes, frame, detection, category, names);
    });
  }
  return std::move(boxes).finish(given.string());
}

}  // namespace sdmt::mot
