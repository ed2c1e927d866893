// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/class_filter.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "sdmt/io/checked_value.h"

namespace sdmt::mot {

namespace {

constexpr std::array<std::string_view, 80> kCocoClasses{
    "person",        "bicycle",      "car",
    "motorcycle",    "airplane",     "bus",
    "train",         "truck",        "boat",
    "traffic light", "fire hydrant", "stop sign",
    "parking meter", "bench",        "bird",
    "cat",           "dog",          "horse",
    "sheep",         "cow",          "elephant",
    "bear",          "zebra",        "giraffe",
    "backpack",      "umbrella",     "handbag",
    "tie",           "suitcase",     "frisbee",
    "skis",          "snowboard",    "sports ball",
    "kite",          "baseball bat", "baseball glove",
    "skateboard",    "surfboard",    "tennis racket",
    "bottle",        "wine glass",   "cup",
    "fork",          "knife",        "spoon",
    "bowl",          "banana",       "apple",
    "sandwich",      "orange",       "broccoli",
    "carrot",        "hot dog",      "pizza",
    "donut",         "cake",         "chair",
    "couch",         "potted plant", "bed",
    "dining table",  "toilet",       "tv",
    "laptop",        "mouse",        "remote",
    "keyboard",      "cell phone",   "microwave",
    "oven",          "toaster",      "sink",
    "refrigerator",  "book",         "clock",
    "vase",          "scissors",     "teddy bear",
    "hair drier",    "toothbrush"};

// Ids between 1 and 90 that COCO left out.
constexpr std::array<int, 10> kUnusedIds{12, 26, 29, 30, 45, 66, 68, 69, 71, 83};

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

}  // namespace

std::string_view coco_class_name(int index) {
  const bool known = index >= 0 && index < static_cast<int>(kCocoClasses.size());
  return known ? kCocoClasses[index] : std::string_view();
}

std::string_view coco_category_name(int id) {
  const auto below = std::lower_bound(kUnusedIds.begin(), kUnusedIds.end(), id);
  if (below != kUnusedIds.end() && *below == id) return {};
  return coco_class_name(id - 1 - static_cast<int>(below - kUnusedIds.begin()));
}

ClassFilter::ClassFilter(std::string_view list) : text_(list) {
  while (true) {
    const auto comma = list.find(',');
    const std::string name = lower(list.substr(0, comma));
    if (name.empty()) {
      io::refuse_value("classes", io::quoted(text_), "names or numbers separated by commas");
    }
    if (name == "all") all_ = true;
    if (const auto number = io::parse_number<int>(name)) {
      numbers_.push_back(*number);
    } else {
      names_.push_back(name);
    }
    if (comma == std::string_view::npos) return;
    list.remove_prefix(comma + 1);
  }
}

bool ClassFilter::wants(int number, std::string_view name) const {
  return all_ || std::find(numbers_.begin(), numbers_.end(), number) != numbers_.end() ||
         (!name.empty() && std::find(names_.begin(), names_.end(), lower(name)) != names_.end());
}

}  // namespace sdmt::mot
