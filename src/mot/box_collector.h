// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sdmt/io/delimited_text.h"
#include "sdmt/mot/detection_formats.h"

namespace sdmt::mot {

/// Gathers the boxes of a file, those of the wanted classes.
class BoxCollector {
 public:
  explicit BoxCollector(const DetectionReading& reading)
      : classes_(reading.classes.value_or(ClassFilter())) {}

  void add(int frame, const Detection& detection, int category, std::string_view name) {
    if (!classes_.wants(category, name)) {
      ++unwanted_[name.empty() ? std::to_string(category) : std::string(name)];
      return;
    }
    rows_.push_back({frame, detection, {}});
  }
  /// All of them; throws std::invalid_argument when there were boxes, but none was wanted.
  DetectionFile finish(const std::string& file) &&;

 private:
  ClassFilter classes_;
  std::map<std::string, std::size_t> unwanted_;
  std::vector<DetectionRow> rows_;
};

/// Throws when `box` is none: without extent, or beyond kFarthest.
template <typename Refuse>
void check_box(const Tlwh& box, Refuse&& refuse) {
  const auto check = [&](const char* name, double value, bool size) {
    if (size && !(value > 0)) refuse(name, value, "> 0");
    if (!(value >= -kFarthest && value <= kFarthest)) refuse(name, value, "-1e12..1e12");
  };
  check("left", box.left, false);
  check("top", box.top, false);
  check("width", box.width, true);
  check("height", box.height, true);
}

/// The readers of the formats. Each throws as read_detections().
DetectionFile read_csv(const std::filesystem::path& path, const DetectionReading& reading);
DetectionFile read_kitti(const std::filesystem::path& path, const DetectionReading& reading);
DetectionFile read_yolo(const std::filesystem::path& folder, const DetectionReading& reading);
DetectionFile read_coco(const std::filesystem::path& path, const DetectionReading& reading);
DetectionFile read_json_lines(const std::filesystem::path& path, const DetectionReading& reading);

/// A frame number as a file says it, with the offset. Throws when there is no such frame.
int offset_frame(long long frame, int offset, const std::string& where);
/// The number that ends the stem of a file's name; nullopt without one.
std::optional<long long> number_of_name(const std::filesystem::path& name);

}  // namespace sdmt::mot
