// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sdmt/io/option_table.h"
#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// Every option of the tracker, in the order of TrackerOptions.
const io::OptionTable<TrackerOptions>& tracker_option_table();

}  // namespace sdmt::track
