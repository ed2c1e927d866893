// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "sdmt/zones/zone_counter.h"

namespace sdmt::zones {

/// The counts as CSV, first of everything (hour "all"), then of each hour in which something
/// happened; lines before areas, in the order of the plan:
///   zone,kind,hour,in,out,stays,inside,most_inside,mean_dwell,longest_dwell
/// Seconds; columns that a kind does not have are empty. "inside": people at the end (of the hour).
/// `hour_name` says what the column holds for an hour of the counter's clock; without it, its
/// number.
std::string counts_table(const ZoneCounter& counter,
                         const std::function<std::string(std::int64_t)>& hour_name = {});

}  // namespace sdmt::zones
