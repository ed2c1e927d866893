// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "sdmt/zones/zone_counter.h"

namespace sdmt::tools {

/// The counts as tables for the terminal, lines and then areas.
std::string zone_counts_text(const zones::ZoneCounter& counter);
/// The same with those of the ground truth for the same plan behind each, as "14 (15)".
std::string zone_counts_text(const zones::ZoneCounter& counter, const zones::ZoneCounter& truth);

}  // namespace sdmt::tools
