// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sdmt::mot {

/// Name of one of the 80 classes of COCO in the order in which detectors are trained, 0 "person" to
/// 79 "toothbrush"; empty for another number.
std::string_view coco_class_name(int index);
/// The same for the category ids of COCO's own files, 1 "person" to 90 "toothbrush", with gaps.
std::string_view coco_category_name(int id);

/// Which boxes are wanted, by what they show.
class ClassFilter {
 public:
  /// People: "person" and "pedestrian".
  ClassFilter() : ClassFilter("person,pedestrian") {}
  /// Names and numbers separated by commas, upper and lower case alike, or "all". Throws
  /// std::invalid_argument for an empty name.
  explicit ClassFilter(std::string_view list);

  /// Whether a class is wanted that has this number and, where it is known, this name. Whoever asks
  /// for a number gets it; so does whoever asks for the name.
  bool wants(int number, std::string_view name) const;
  bool wants_all() const { return all_; }
  /// For messages.
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::vector<std::string> names_;  // in lower case
  std::vector<int> numbers_;
  bool all_ = false;
};

}  // namespace sdmt::mot
