// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/counts_table.h"

#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "sdmt/io/checked_value.h"

namespace sdmt::zones {

namespace {

std::string field(const std::string& text) {
  if (text.find_first_of("\",\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string seconds(double value) { return io::number_text(std::round(value * 1000) / 1000); }

void add_rows(const ZonePlan& plan, const std::string& hour, const std::vector<LineCounts>* lines,
              const std::vector<AreaCounts>* areas, std::string& table) {
  for (std::size_t i = 0; lines != nullptr && i < lines->size(); ++i) {
    const LineCounts& line = (*lines)[i];
    table += field(plan.lines[i].name) + ",line," + hour + "," + std::to_string(line.in) + "," +
             std::to_string(line.out) + ",,,,,\n";
  }
  for (std::size_t i = 0; areas != nullptr && i < areas->size(); ++i) {
    const AreaCounts& area = (*areas)[i];
    table += field(plan.areas[i].name) + ",area," + hour + ",,," + std::to_string(area.stays) +
             "," + std::to_string(area.inside) + "," + std::to_string(area.most_inside) + "," +
             seconds(area.mean_dwell()) + "," + seconds(area.longest) + "\n";
  }
}

template <typename Counts>
const std::vector<Counts>* find(const std::map<std::int64_t, std::vector<Counts>>& hours,
                                std::int64_t hour) {
  const auto found = hours.find(hour);
  return found == hours.end() ? nullptr : &found->second;
}

}  // namespace

std::string counts_table(const ZoneCounter& counter,
                         const std::function<std::string(std::int64_t)>& hour_name) {
  std::string table = "zone,kind,hour,in,out,stays,inside,most_inside,mean_dwell,longest_dwell\n";
  add_rows(counter.plan(), "all", &counter.lines(), &counter.areas(), table);
  std::set<std::int64_t> hours;
  for (const auto& [hour, _] : counter.line_hours()) hours.insert(hour);
  for (const auto& [hour, _] : counter.area_hours()) hours.insert(hour);
  for (const std::int64_t hour : hours) {
    add_rows(counter.plan(), hour_name ? hour_name(hour) : std::to_string(hour),
             find(counter.line_hours(), hour), find(counter.area_hours(), hour), table);
  }
  return table;
}

}  // namespace sdmt::zones
