// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/zones/zone_counter.h"

namespace sdmt::zones {

/// The counts as CSV, first of everything (hour "all"), then of each hour in which something
/// happened; lines before areas, in the order of the plan:
///   zone,kind,hour,in,out,stays,inside,most_inside,mean_dwell,longest_dwell
/// Seconds; columns that a kind does not have are empty. "inside": people at the end (of the hour).
std::string counts_table(const ZoneCounter& counter);

}  // namespace sdmt::zones
