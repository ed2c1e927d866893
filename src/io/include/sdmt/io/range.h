// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <string>
#include <string_view>

#include "sdmt/io/checked_value.h"

namespace sdmt::io {

/// Numbers that an option takes. Never NaN.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above = false;  ///< low itself is not among them
  bool below = false;  ///< nor is high
  bool odd = false;

  bool holds(double value) const;
  /// "0..1", "> 0 and <= 100", ">= 1", "an odd number in 1..31"; "a number" without bounds.
  std::string text() const;
};

/// Refuses, as `FIELD is VALUE, expected RANGE`, a value outside.
template <typename Number>
void require_in(std::string_view field, Number value, const Range& range) {
  require(range.holds(static_cast<double>(value)), field, value, range.text());
}

}  // namespace sdmt::io
