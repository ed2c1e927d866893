// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/zones/zone_counter.h"

namespace sdmt::zones {

/// An event as a JSON object with a line end:
///   {"event":"in","zone":"door","id":3,"frame":120,"time":4.76,"witnessed":true}
/// `leave` has "dwell", in seconds; `continued` has "former_id" and no "witnessed". `utc`: the time
/// by the clock on the wall, which then stands behind "time"; empty where there is none.
std::string event_line(const ZoneEvent& event, const std::string& utc = "");

}  // namespace sdmt::zones
