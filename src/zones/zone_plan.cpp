// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/zone_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <stdexcept>

#include "geometry.h"
#include "sdmt/io/checked_value.h"
#include "sdmt/io/delimited_text.h"
#include "sdmt/io/json_text.h"

namespace sdmt::zones {

using nlohmann::json;

namespace {

constexpr double kFarthest = 1e6;
constexpr std::size_t kLongestName = 64;
constexpr std::size_t kMostCorners = 200;

[[noreturn]] void refuse(const std::string& zone, const std::string& what) {
  throw std::invalid_argument(zone + ": " + what);
}

std::string title(const char* kind, const std::string& name) {
  return std::string(kind) + " " + io::quoted(name);
}

void check_point(const std::string& zone, Point p) {
  for (const double value : {p.x, p.y}) {
    if (!(std::abs(value) <= kFarthest)) {
      refuse(zone, "a coordinate is " + io::number_text(value) + ", expected -1e6..1e6");
    }
  }
}

void check_area(const std::string& zone, const Area& area) {
  const std::size_t count = area.corners.size();
  if (count < 3 || count > kMostCorners) {
    refuse(zone, "has " + std::to_string(count) + " corners, expected 3 to 200");
  }
  for (const Point corner : area.corners) check_point(zone, corner);
  const auto corner = [&](std::size_t i) { return area.corners[i % count]; };
  for (std::size_t i = 0; i < count; ++i) {
    if (corner(i) == corner(i + 1)) {
      refuse(zone, "corner " + std::to_string(i + 1) + " comes twice");
    }
    for (std::size_t j = i + 2; j < count; ++j) {
      if (j + 1 == i + count) continue;  // neighbours share a corner
      if (segments_meet(corner(i), corner(i + 1), corner(j), corner(j + 1))) {
        refuse(zone, "the edges after corners " + std::to_string(i + 1) + " and " +
                         std::to_string(j + 1) + " cross; expected corners in order around it");
      }
    }
  }
  if (!(depth(area) > 0)) refuse(zone, "has no extent");
}

// An object of the file, with its place for messages.
class Entry {
 public:
  Entry(const json& value, std::string where, std::initializer_list<const char*> keys)
      : value_(value), where_(std::move(where)) {
    if (!value.is_object()) refuse(where_, "is " + shown(value) + ", expected an object");
    for (const auto& [key, _] : value.items()) {
      if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
      std::string known;
      for (const char* name : keys) known += (known.empty() ? "" : ", ") + std::string(name);
      refuse(where_, "unknown key " + io::quoted(key) + ", expected " + known);
    }
  }

  bool has(const char* key) const { return value_.contains(key); }
  const json& list(const char* key) const {
    if (!has(key)) refuse(where_, std::string(key) + " is missing");
    if (!value_[key].is_array())
      refuse(where_, std::string(key) + " is " + shown(value_[key]) + ", expected a list");
    return value_[key];
  }
  std::string name() const {
    if (!has("name")) refuse(where_, "name is missing");
    if (!value_["name"].is_string()) {
      refuse(where_, "name is " + shown(value_["name"]) + ", expected a text");
    }
    return value_["name"].get<std::string>();
  }
  Point point(const char* key) const { return point_of(list(key), key); }
  std::vector<Point> points(const char* key) const {
    std::vector<Point> result;
    for (const json& value : list(key)) result.push_back(point_of(value, key));
    return result;
  }

 private:
  static std::string shown(const json& value) { return io::printable(value.dump(), 60); }
  Point point_of(const json& value, const char* key) const {
    if (!value.is_array() || value.size() != 2 || !value[0].is_number() || !value[1].is_number()) {
      refuse(where_, std::string(key) + ": " + shown(value) + " is no point, expected [x, y]");
    }
    return {value[0].get<double>(), value[1].get<double>()};
  }

  const json& value_;
  std::string where_;
};

ZonePlan read(const json& file, const std::string& name) {
  const Entry root(file, name, {"picture", "lines", "areas"});
  ZonePlan plan;
  if (root.has("picture")) {
    const Point size = root.point("picture");
    for (const double side : {size.x, size.y}) {
      if (!(side >= 1 && side <= kFarthest && side == std::floor(side))) {
        refuse(name, "picture: a side is " + io::number_text(side) +
                         ", expected whole pixels, 1..1000000");
      }
    }
    plan.width = static_cast<int>(size.x);
    plan.height = static_cast<int>(size.y);
  }
  const auto entries = [&](const char* key, std::initializer_list<const char*> keys,
                           const auto& add) {
    if (!root.has(key)) return;
    const json& list = root.list(key);
    for (std::size_t i = 0; i < list.size(); ++i) {
      add(Entry(list[i], name + ": " + key + "[" + std::to_string(i) + "]", keys));
    }
  };
  entries("lines", {"name", "from", "to"}, [&](const Entry& line) {
    plan.lines.push_back({line.name(), line.point("from"), line.point("to")});
  });
  entries("areas", {"name", "corners"}, [&](const Entry& area) {
    plan.areas.push_back({area.name(), area.points("corners")});
  });
  return plan;
}

}  // namespace

void ZonePlan::validate() const {
  if (lines.empty() && areas.empty()) {
    throw std::invalid_argument("no zone, expected \"lines\" or \"areas\"");
  }
  std::set<std::string> names;
  const auto check_name = [&](const std::string& zone, const std::string& name) {
    if (name.empty() || name.size() > kLongestName) {
      refuse(zone, "the name has " + std::to_string(name.size()) + " bytes, expected 1 to 64");
    }
    if (!names.insert(name).second) refuse(zone, "the name comes twice");
  };
  for (const Line& line : lines) {
    const std::string zone = title("line", line.name);
    check_name(zone, line.name);
    check_point(zone, line.from);
    check_point(zone, line.to);
    if (line.from == line.to) refuse(zone, "has no length");
  }
  for (const Area& area : areas) {
    const std::string zone = title("area", area.name);
    check_name(zone, area.name);
    check_area(zone, area);
  }
}

ZonePlan ZonePlan::in_picture(int picture_width, int picture_height) const {
  ZonePlan plan = *this;
  if (width > 0) {
    const double across = static_cast<double>(picture_width) / width;
    const double down = static_cast<double>(picture_height) / height;
    constexpr double kSameProportions = 1.02;
    if (across > down * kSameProportions || down > across * kSameProportions) {
      throw std::invalid_argument(
          "the zones are drawn in a picture of " + std::to_string(width) + " x " +
          std::to_string(height) + ", the input has " + std::to_string(picture_width) + " x " +
          std::to_string(picture_height) + ", expected the same proportions");
    }
    // The first pixel is 1 at every size.
    const auto scale = [&](Point& p) { p = {(p.x - 1) * across + 1, (p.y - 1) * down + 1}; };
    for (Line& line : plan.lines) {
      scale(line.from);
      scale(line.to);
    }
    for (Area& area : plan.areas) std::for_each(area.corners.begin(), area.corners.end(), scale);
  }
  plan.width = picture_width;
  plan.height = picture_height;
  const auto check_seen = [&](const std::string& zone, std::span<const Point> points) {
    const auto all = [&](auto&& beyond) {
      return std::all_of(points.begin(), points.end(), beyond);
    };
    if (all([](Point p) { return p.x < 1; }) || all([](Point p) { return p.y < 1; }) ||
        all([&](Point p) { return p.x > picture_width; }) ||
        all([&](Point p) { return p.y > picture_height; })) {
      refuse(zone, "lies outside of the picture of " + std::to_string(picture_width) + " x " +
                       std::to_string(picture_height) + "; give \"picture\": [width, height] if " +
                       "it was drawn in one of another size");
    }
  };
  for (const Line& line : plan.lines) {
    check_seen(title("line", line.name), std::array{line.from, line.to});
  }
  for (const Area& area : plan.areas) {
    check_seen(title("area", area.name), area.corners);
  }
  return plan;
}

ZonePlan parse_zone_plan(std::string_view text, const std::string& name) {
  io::check_json(text, name);
  ZonePlan plan = read(json::parse(text), name);
  try {
    plan.validate();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + ": " + error.what());
  }
  return plan;
}

ZonePlan read_zone_plan(const std::filesystem::path& file) {
  return parse_zone_plan(io::read_text(file), file.string());
}

}  // namespace sdmt::zones
