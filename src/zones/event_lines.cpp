// SPDX-License-Identifier: Apache-2.0
#include "sdmt/zones/event_lines.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace sdmt::zones {

namespace {

double milliseconds(double seconds) { return std::round(seconds * 1000) / 1000; }

}  // namespace

std::string event_line(const ZoneEvent& event, const std::string& utc) {
  nlohmann::ordered_json line;
  line["event"] = to_string(event.kind);
  line["zone"] = event.zone;
  line["id"] = event.id;
  if (event.kind == EventKind::continued) line["former_id"] = event.former_id;
  line["frame"] = event.frame;
  line["time"] = milliseconds(event.time);
  if (!utc.empty()) line["utc"] = utc;
  if (event.kind == EventKind::leave) line["dwell"] = milliseconds(event.dwell);
  if (event.kind != EventKind::continued) line["witnessed"] = event.witnessed;
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace sdmt::zones
