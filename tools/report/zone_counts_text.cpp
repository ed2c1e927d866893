// SPDX-License-Identifier: Apache-2.0
#include "report/zone_counts_text.h"

#include <fmt/format.h>

#include "cli/text_table.h"
#include "sdmt/io/checked_value.h"

namespace sdmt::tools {

namespace {

std::string text(const zones::ZoneCounter& counter, const zones::ZoneCounter* truth) {
  const auto number = [&](auto value_of, auto&& shown) {
    std::string cell = shown(value_of(counter));
    if (truth != nullptr) cell += " (" + shown(value_of(*truth)) + ")";
    return cell;
  };
  const auto whole = [](auto value) { return fmt::format("{}", value); };
  const auto seconds = [](double value) { return fmt::format("{:.1f}", value); };
  using Counter = zones::ZoneCounter;
  const zones::ZonePlan& plan = counter.plan();

  std::string result;
  if (!plan.lines.empty()) {
    TextTable table({"line", "in", "out"});
    for (std::size_t i = 0; i < plan.lines.size(); ++i) {
      table.add_row({io::printable(plan.lines[i].name),
                     number([i](const Counter& c) { return c.lines()[i].in; }, whole),
                     number([i](const Counter& c) { return c.lines()[i].out; }, whole)});
    }
    result += table.str();
  }
  if (!plan.areas.empty()) {
    TextTable table({"area", "stays", "at once", "mean s", "longest s"});
    for (std::size_t i = 0; i < plan.areas.size(); ++i) {
      table.add_row({io::printable(plan.areas[i].name),
                     number([i](const Counter& c) { return c.areas()[i].stays; }, whole),
                     number([i](const Counter& c) { return c.areas()[i].most_inside; }, whole),
                     number([i](const Counter& c) { return c.areas()[i].mean_dwell(); }, seconds),
                     number([i](const Counter& c) { return c.areas()[i].longest; }, seconds)});
    }
    result += table.str();
  }
  return result;
}

}  // namespace

std::string zone_counts_text(const zones::ZoneCounter& counter) { return text(counter, nullptr); }

std::string zone_counts_text(const zones::ZoneCounter& counter, const zones::ZoneCounter& truth) {
  return text(counter, &truth);
}

}  // namespace sdmt::tools
