// SPDX-License-Identifier: Apache-2.0
// Boxes in JSON: COCO, and an object a line.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "box_collector.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/json_text.h"

namespace sdmt::mot {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

// A value with the place it came from for messages.
struct Place {
  const json& value;
  std::string where;  // "coco.json: entry 3: bbox"

  [[noreturn]] void refuse(const std::string& expected) const {
    throw std::invalid_argument(where + " is " + io::printable(value.dump(), 60) + ", expected " +
                                expected);
  }
  double number() const {
    if (!value.is_number()) refuse("a number");
    return value.get<double>();
  }
  long long whole() const {
    constexpr double kLargest = 1e15;
    if (!value.is_number() || std::abs(number()) > kLargest || number() != std::floor(number())) {
      refuse("a whole number up to 1e15");
    }
    return static_cast<long long>(number());
  }
  const json& list() const {
    if (!value.is_array()) refuse("a list");
    return value;
  }
};

std::string item(const std::string& list, std::size_t i) {
  return list + "[" + std::to_string(i) + "]";
}

Tlwh read_box(const json& value, const std::string& where, double first_pixel) {
  const Place place{value, where};
  if (!value.is_array() || value.size() != 4) place.refuse("[left, top, width, height]");
  double side[4];
  for (std::size_t i = 0; i < 4; ++i) side[i] = Place{value[i], item(where, i)}.number();
  const Tlwh box{side[0] + 1 - first_pixel, side[1] + 1 - first_pixel, side[2], side[3]};
  check_box(box, [&](const char* name, double number, const char* expected) {
    throw std::invalid_argument(where + ": " + name + " is " + io::number_text(number) +
                                ", expected " + expected);
  });
  return box;
}

// Frame numbers by image id, where the file lists its images.
std::map<json, long long> frames_of_images(const json& file, const std::string& name) {
  std::map<json, long long> frames;
  if (!file.contains("images")) return frames;
  const json& images = Place{file["images"], name + ": images"}.list();
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string where = item(name + ": images", i);
    const json& image = images[i];
    if (!image.is_object() || !image.contains("id"))
      Place{image, where}.refuse("an object with an id");
    std::optional<long long> number;
    if (image.contains("frame_id")) {
      number = Place{image["frame_id"], where + ".frame_id"}.whole();
    } else if (image.contains("file_name") && image["file_name"].is_string()) {
      number = number_of_name(image["file_name"].get<std::string>());
    }
    frames[image["id"]] = number ? *number : Place{image["id"], where + ".id"}.whole();
  }
  return frames;
}

std::map<long long, std::string> names_of_categories(const json& file, const std::string& name) {
  std::map<long long, std::string> names;
  if (!file.contains("categories")) return names;
  const json& list = Place{file["categories"], name + ": categories"}.list();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string where = item(name + ": categories", i);
    if (!list[i].is_object() || !list[i].contains("id")) {
      Place{list[i], where}.refuse("an object with an id");
    }
    const json text = list[i].value("name", json(""));
    if (!text.is_string()) Place{text, where + ".name"}.refuse("a text");
    names[Place{list[i]["id"], where + ".id"}.whole()] = text.get<std::string>();
  }
  return names;
}

}  // namespace

DetectionFile read_coco(const fs::path& path, const DetectionReading& reading) {
  const std::string name = path.string();
  const std::string text = io::read_text(path);
  io::check_json(text, name);
  const json file = json::parse(text);
  const bool results = file.is_array();
  if (!results && !(file.is_object() && file.contains("annotations"))) {
    throw std::invalid_argument(
        name + ": is no COCO file, expected a list of results, or an object with annotations");
  }
  const json& entries = results ? file : Place{file["annotations"], name + ": annotations"}.list();
  const auto frames = results ? std::map<json, long long>() : frames_of_images(file, name);
  const auto names = results ? std::map<long long, std::string>() : names_of_categories(file, name);
  BoxCollector boxes(reading);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const json& entry = entries[i];
    const std::string where = name + ": entry " + std::to_string(i + 1) + ": ";
    const auto value = [&](const char* key) -> const json& {
      if (!entry.is_object() || !entry.contains(key)) {
        throw std::invalid_argument(where + key + " is missing");
      }
      return entry[key];
    };
    if (entry.is_object() && entry.contains("iscrowd") && entry["iscrowd"] == 1) continue;
    Detection detection;
    detection.box = read_box(value("bbox"), where + "bbox", 0);
    if (entry.contains("score")) detection.score = Place{entry["score"], where + "score"}.number();
    const json& image = value("image_id");
    long long frame = 0;
    if (frames.empty()) {
      const auto of_name =
          image.is_string() ? number_of_name(image.get<std::string>()) : std::nullopt;
      frame = of_name ? *of_name : Place{image, where + "image_id"}.whole();
    } else if (const auto found = frames.find(image); found != frames.end()) {
      frame = found->second;
    } else {
      Place{image, where + "image_id"}.refuse("the id of one of the images");
    }
    const long long category = Place{value("category_id"), where + "category_id"}.whole();
    const auto named = names.find(category);
    const int number = category >= 0 && category < 1'000'000 ? static_cast<int>(category) : -1;
    boxes.add(offset_frame(frame, reading.frame_offset, where + "image_id"), detection, number,
              named != names.end() ? std::string_view(named->second)
              : names.empty()      ? coco_category_name(number)
                                   : std::string_view());
  }
  return std::move(boxes).finish(name);
}

JsonLineReader::JsonLineReader(std::string name, const DetectionReading& reading)
    : name_(std::move(name)),
      classes_(reading.classes.value_or(ClassFilter())),
      offset_(reading.frame_offset),
      last_time_(-std::numeric_limits<double>::infinity()) {}

JsonLineReader::Frame JsonLineReader::read(std::string_view line, std::size_t line_number) {
  const std::string where = name_ + ":" + std::to_string(line_number);
  io::check_json(line, where);
  const json object = json::parse(line);
  if (!object.is_object() || !object.contains("boxes")) {
    throw std::invalid_argument(where +
                                ": has no boxes, expected {\"frame\": 1, \"boxes\": [[left, top, "
                                "width, height], ...], \"scores\": [...]}");
  }
  for (const auto& [key, value] : object.items()) {
    const std::string_view known[] = {"frame", "boxes", "scores", "classes", "embeddings", "time"};
    if (std::find(std::begin(known), std::end(known), key) != std::end(known)) continue;
    throw std::invalid_argument(where + ": unknown key " + io::quoted(key) +
                                ", expected frame, boxes, scores, classes, embeddings or time");
  }
  Frame frame;
  frame.number = last_frame_ + 1;
  if (object.contains("frame")) {
    frame.number = offset_frame(Place{object["frame"], where + ": frame"}.whole(), offset_, where);
    if (frame.number <= last_frame_) {
      throw std::invalid_argument(where + ": frame " + std::to_string(frame.number) +
                                  " follows frame " + std::to_string(last_frame_) +
                                  ", expected a later one (one line a frame)");
    }
  }
  if (object.contains("time")) {
    const double time = Place{object["time"], where + ": time"}.number();
    if (time < last_time_) {
      Place{object["time"], where + ": time"}.refuse(">= " + io::number_text(last_time_));
    }
    last_time_ = time;
    frame.time = time;
  }
  const json& boxes = Place{object["boxes"], where + ": boxes"}.list();
  const auto beside = [&](const char* key) -> const json* {
    if (!object.contains(key)) return nullptr;
    const json& list = Place{object[key], where + ": " + key}.list();
    if (list.size() != boxes.size()) {
      throw std::invalid_argument(where + ": " + key + " has " + std::to_string(list.size()) +
                                  " entries, expected " + std::to_string(boxes.size()) +
                                  ", one a box");
    }
    return &list;
  };
  const json* scores = beside("scores");
  const json* classes = beside("classes");
  const json* embeddings = beside("embeddings");
  if (!has_embeddings_) has_embeddings_ = embeddings != nullptr;
  if (!boxes.empty() && (embeddings != nullptr) != *has_embeddings_) {
    throw std::invalid_argument(where + ": embeddings are " +
                                (embeddings == nullptr ? "missing" : "here") +
                                ", expected in all lines or in none, as the first says");
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    Detection detection;
    detection.box = read_box(boxes[i], item(where + ": boxes", i), 1);
    if (scores != nullptr) {
      detection.score = Place{(*scores)[i], item(where + ": scores", i)}.number();
    }
    std::vector<float> vector;
    if (embeddings != nullptr) {
      const std::string at = item(where + ": embeddings", i);
      const json& values = Place{(*embeddings)[i], at}.list();
      if (dimension_ == 0) dimension_ = static_cast<int>(values.size());
      double squares = 0;
      for (std::size_t k = 0; k < values.size(); ++k) {
        vector.push_back(static_cast<float>(Place{values[k], item(at, k)}.number()));
        squares += static_cast<double>(vector.back()) * vector.back();
      }
      if (static_cast<int>(values.size()) != dimension_ || values.empty()) {
        throw std::invalid_argument(at + " has " + std::to_string(values.size()) +
                                    " values, expected " + std::to_string(std::max(1, dimension_)) +
                                    ", as the first");
      }
      if (!(squares > 0) || !std::isfinite(squares)) {
        throw std::invalid_argument(at + " has no length, expected a vector that is not 0");
      }
      for (float& value : vector) value = static_cast<float>(value / std::sqrt(squares));
    }
    if (classes != nullptr) {
      const json& category = (*classes)[i];
      const Place place{category, item(where + ": classes", i)};
      const bool named = category.is_string();
      if (!named && !category.is_number_integer()) place.refuse("a name or a number");
      const int number = named ? -1 : static_cast<int>(std::clamp(place.whole(), -1LL, 1000000LL));
      const std::string text =
          named ? category.get<std::string>() : std::string(coco_class_name(number));
      if (!classes_.wants(number, text)) {
        ++unwanted_;
        continue;
      }
    }
    frame.detections.push_back(detection);
    frame.embeddings.insert(frame.embeddings.end(), vector.begin(), vector.end());
  }
  last_frame_ = frame.number;
  return frame;
}

DetectionFile read_json_lines(const fs::path& path, const DetectionReading& reading) {
  JsonLineReader reader(path.string(), reading);
  std::vector<DetectionRow> rows;
  std::map<int, double> times;
  io::for_each_line(io::read_text(path), [&](std::size_t number, std::string_view line) {
    JsonLineReader::Frame frame = reader.read(line, number);
    if (frame.time) times.emplace(frame.number, *frame.time);
    const auto dimension = static_cast<std::size_t>(reader.dimension());
    for (std::size_t i = 0; i < frame.detections.size(); ++i) {
      const auto begin = frame.embeddings.begin() + static_cast<std::ptrdiff_t>(i * dimension);
      rows.push_back({frame.number, frame.detections[i],
                      std::vector<float>(begin, begin + static_cast<std::ptrdiff_t>(dimension))});
    }
  });
  if (rows.empty() && reader.unwanted() > 0) {
    throw std::invalid_argument(path.string() + ": no box is of a wanted class, expected " +
                                reading.classes.value_or(ClassFilter()).text() +
                                "; choose with --classes");
  }
  DetectionFile file = DetectionFile::from_rows(std::move(rows), path.string());
  file.set_times(std::move(times));
  return file;
}

}  // namespace sdmt::mot
