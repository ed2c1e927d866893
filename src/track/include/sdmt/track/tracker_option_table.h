// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "sdmt/track/tracker_options.h"

namespace sdmt::track {

/// One field of TrackerOptions by the name it has on a command line and in a config file.
struct TrackerOption {
  const char* name;  ///< in kebab-case, without dashes
  const char* help;  ///< one line with the range
  bool is_switch;    ///< on or off; the values are "true" and "false"
  /// Reads the value from text; range checks are TrackerOptions::validate()'s. Throws
  /// std::invalid_argument naming option, text and what was expected.
  std::function<void(TrackerOptions&, std::string_view)> set;
  /// The value as set() takes it.
  std::function<std::string(const TrackerOptions&)> get;
};

/// Every option, in the order of TrackerOptions.
std::span<const TrackerOption> tracker_option_table();

}  // namespace sdmt::track
