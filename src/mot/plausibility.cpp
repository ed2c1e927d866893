// SPDX-License-Identifier: Apache-2.0
#include "sdmt/mot/plausibility.h"

#include <algorithm>
#include <cmath>

namespace sdmt::mot {

namespace {

constexpr std::size_t kEnough = 20;
constexpr double kNearlyAll = 0.98;
constexpr const char* kCure = "; expected left,top,width,height in pixels";

double right(const Tlwh& box) { return box.left + box.width; }
double bottom(const Tlwh& box) { return box.top + box.height; }

// The share of the boxes for which `holds`.
template <typename Holds>
double share(std::span<const Tlwh> boxes, Holds holds) {
  const auto count = std::count_if(boxes.begin(), boxes.end(), holds);
  return static_cast<double>(count) / static_cast<double>(boxes.size());
}

std::string percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

std::string size_text(double width, double height) {
  return std::to_string(std::lround(width)) + " x " + std::to_string(std::lround(height));
}

bool fractions(std::span<const Tlwh> boxes) {
  return share(boxes, [](const Tlwh& b) {
           return b.left > -0.5 && b.top > -0.5 && b.width <= 1.01 && b.height <= 1.01 &&
                  b.left <= 1.01 && b.top <= 1.01;
         }) == 1;
}

// Whoever walks through a picture leaves its upper left hundred pixels.
bool percentages(std::span<const Tlwh> boxes, int width, int height) {
  constexpr double kWhole = 100, kSlack = 5, kReach = 60;
  constexpr int kSmallest = 200;
  if (std::min(width, height) < kSmallest || boxes.size() < 5 * kEnough) return false;
  double reach_x = 0, reach_y = 0;
  for (const Tlwh& box : boxes) {
    if (box.left < -kSlack || box.top < -kSlack) return false;
    reach_x = std::max(reach_x, right(box));
    reach_y = std::max(reach_y, bottom(box));
  }
  return std::min(reach_x, reach_y) >= kReach && std::max(reach_x, reach_y) <= kWhole + kSlack;
}

bool wider_than_tall(std::span<const Tlwh> boxes) {
  constexpr double kMost = 0.9;
  return share(boxes, [](const Tlwh& b) { return b.width > b.height; }) >= kMost;
}

// A box that lies right of and below the middle of its own size does so in few pictures; two
// corners always look as if it did.
bool corners(std::span<const Tlwh> boxes, int width, int height) {
  return share(boxes, [&](const Tlwh& b) {
           const bool ordered = b.width > b.left && b.height > b.top;
           const bool fits = width == 0 || (b.width <= 1.1 * width && b.height <= 1.1 * height);
           return ordered && fits;
         }) >= kNearlyAll;
}

// As centres all boxes lie within the picture, as corners some leave it at the right or below, and
// none at the left or above. One person who stands at the border is no evidence, in however many
// boxes.
bool centres(std::span<const Tlwh> boxes, int width, int height) {
  constexpr double kSlack = 2, kSome = 0.05;
  const auto inside = [&](const Tlwh& b) {
    return b.left >= b.width / 2 - kSlack && b.top >= b.height / 2 - kSlack &&
           b.left + b.width / 2 <= width + kSlack && b.top + b.height / 2 <= height + kSlack;
  };
  const auto leaves = [&](const Tlwh& b) {
    return right(b) > width + kSlack || bottom(b) > height + kSlack;
  };
  const auto first = std::find_if(boxes.begin(), boxes.end(), leaves);
  const bool several = std::any_of(first, boxes.end(),
                                   [&](const Tlwh& b) { return leaves(b) && iou(b, *first) == 0; });
  return several && share(boxes, inside) >= kNearlyAll && share(boxes, leaves) >= kSome;
}

// Boxes of a larger picture lie outside this one; those of a smaller one end at about the same
// share of its width and height.
std::string other_size(std::span<const Tlwh> boxes, int width, int height) {
  constexpr double kMany = 0.1, kSmaller = 0.72, kAlike = 0.1;
  double reach_x = 0, reach_y = 0;
  for (const Tlwh& box : boxes) {
    reach_x = std::max(reach_x, right(box));
    reach_y = std::max(reach_y, bottom(box));
  }
  const double outside =
      share(boxes, [&](const Tlwh& b) { return b.left >= width || b.top >= height; });
  const std::string reach =
      "reach to " + size_text(reach_x, reach_y) + ", the picture is " + size_text(width, height);
  if (outside >= kMany) {
    return percent(outside) + " of the boxes lie outside the picture: they " + reach +
           "; scale them to its size";
  }
  const double x = reach_x / width, y = reach_y / height;
  if (std::max(x, y) < kSmaller && std::abs(x - y) < kAlike && boxes.size() >= 5 * kEnough) {
    return "the boxes only " + reach + ": were they made for a smaller one? Then scale them";
  }
  return {};
}

}  // namespace

std::string describe_implausible(std::span<const Tlwh> boxes, int width, int height) {
  if (boxes.empty()) return {};
  if (fractions(boxes)) {
    return "all boxes lie within 0..1: they look like fractions of the picture (YOLO's format)" +
           std::string(kCure);
  }
  if (boxes.size() < kEnough) return {};
  if (corners(boxes, width, height)) {
    return "the boxes look like two corners (left,top,right,bottom)" + std::string(kCure);
  }
  if (width == 0 || height == 0) return {};
  if (centres(boxes, width, height)) {
    return "the boxes look like centres and sizes (cx,cy,width,height)" + std::string(kCure);
  }
  if (percentages(boxes, width, height)) {
    return "all boxes lie within 0..100: they look like percent of the picture" +
           std::string(kCure);
  }
  if (auto text = other_size(boxes, width, height); !text.empty()) return text;
  if (wider_than_tall(boxes)) {
    return "the boxes are wider than tall: are widths and heights swapped?" + std::string(kCure);
  }
  return {};
}

std::string describe_implausible(const DetectionFile& file, int width, int height) {
  std::vector<Tlwh> boxes;
  boxes.reserve(file.size());
  for (const Detection& detection : file.detections()) boxes.push_back(detection.box);
  const std::string text = describe_implausible(boxes, width, height);
  if (!text.empty()) return text;
  if (file.columns() > DetectionFile::kMostColumns) {
    return "a line has " + std::to_string(file.columns()) + " columns, expected 7 to " +
           std::to_string(DetectionFile::kMostColumns) +
           ": are there commas within numbers? Decimals take a point";
  }
  if (file.classes().size() < 2) return {};
  std::string list;
  for (const auto& [category, count] : file.classes()) {
    list += (list.empty() ? "" : ", ") + std::to_string(category) + " (" + std::to_string(count) +
            " boxes)";
  }
  return "the eighth column looks like classes, " + list +
         "; every box is taken for a person, leave only people in the file";
}

}  // namespace sdmt::mot
