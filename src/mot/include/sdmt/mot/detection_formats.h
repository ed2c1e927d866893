// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "sdmt/mot/class_filter.h"
#include "sdmt/mot/mot_file.h"

namespace sdmt::mot {

/// How people write boxes. Where a format has no scores, all are 1. In brackets: how it counts
/// pixels and frames; what is read counts both from 1.
enum class DetectionFormat {
  mot,         ///< DetectionFile::read(); also with blanks in place of commas (1, 1)
  csv,         ///< a header that names the columns, commas, semicolons or tabs (1, 1)
  json_lines,  ///< an object a line, as read_json_line() (1, 1)
  kitti,       ///< tracking: frame, track, type, ..., left, top, right, bottom, ... [score] (0, 0)
  coco,        ///< a list of results, or annotations with their images and categories (0, 1)
  yolo,        ///< a folder with a text file a frame: class, centre, size [score], fractions (0, 1)
};

/// By its name: mot, csv, jsonl, kitti, coco or yolo.
std::optional<DetectionFormat> parse_detection_format(std::string_view name);

/// How a file is to be read.
struct DetectionReading {
  std::optional<DetectionFormat> format{};  ///< default: recognise_format()
  /// What is wanted, in formats that say what a box shows; in MOT files only when asked for.
  std::optional<ClassFilter> classes{};
  int frame_offset = 0;  ///< added to every frame number
  int width = 0;         ///< of the picture, pixels; yolo needs it
  int height = 0;
};

/// By what it holds: a folder is yolo; in files the first line decides. Throws
/// std::invalid_argument when there is no such file, or when it is one of such a folder.
DetectionFormat recognise_format(const std::filesystem::path& path);

/// Frames are named by COCO's image_id, or, where there are annotations with images, by an image's
/// frame_id, else by the number that ends its file's name; in yolo by that of the text file. Class
/// names are COCO's unless the file has categories, or the folder (or the one above) a classes.txt.
/// Throws std::invalid_argument naming file, line (or entry), value and what was expected, also
/// when there are boxes but none of a wanted class.
DetectionFile read_detections(const std::filesystem::path& path,
                              const DetectionReading& reading = {});

/// The boxes of a frame as one line of JSON tells them:
///
///   {"frame": 1, "boxes": [[left, top, width, height], ...], "scores": [0.9, ...],
///    "classes": ["person", ...], "embeddings": [[0.1, ...], ...], "time": 0.04}
///
/// Only the boxes must be there; without a number a frame is the one after the last. Classes are
/// names or numbers. Embeddings, a vector a box, all of one dimension, are scaled to length 1; the
/// first line says whether they come ("embeddings": [] where it has no boxes). Times (seconds) must
/// not fall.
class JsonLineReader {
 public:
  /// `name`: of the file, for messages.
  JsonLineReader(std::string name, const DetectionReading& reading);

  struct Frame {
    int number = 0;
    std::vector<Detection> detections;
    std::vector<float> embeddings;  ///< [detections, dimension()], or empty
    std::optional<double> time;     ///< seconds
  };
  /// The next line, which is not blank. Throws std::invalid_argument naming file, line and value.
  Frame read(std::string_view line, std::size_t line_number);

  /// Whether embeddings come with the boxes, as the first line said.
  bool has_embeddings() const { return has_embeddings_.value_or(false); }
  /// Values of an embedding; 0 as long as none came.
  int dimension() const { return dimension_; }
  /// Boxes whose class is not wanted.
  std::size_t unwanted() const { return unwanted_; }

 private:
  std::string name_;
  ClassFilter classes_;
  int offset_;
  int last_frame_ = 0;
  double last_time_;
  int dimension_ = 0;
  std::optional<bool> has_embeddings_;  // none before the first line
  std::size_t unwanted_ = 0;
};

}  // namespace sdmt::mot
