// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/range.h"

#include <cmath>

namespace sdmt::io {

namespace {

// Whole numbers without an exponent: 1000000, not 1e+06.
std::string bound_text(double bound) {
  const bool whole = bound == std::trunc(bound) && std::abs(bound) < 1e15;
  return whole ? number_text(static_cast<long long>(bound)) : number_text(bound);
}

}  // namespace

bool Range::holds(double value) const {
  if (std::isnan(value) || value < low || value > high) return false;
  if ((above && value == low) || (below && value == high)) return false;
  return !odd || std::fmod(std::abs(value), 2) == 1;
}

std::string Range::text() const {
  const std::string span = bound_text(low) + ".." + bound_text(high);
  if (odd) return "an odd number in " + span;
  const bool bounded_below = std::isfinite(low), bounded_above = std::isfinite(high);
  if (bounded_below && bounded_above && !above && !below) return span;
  std::string text;
  if (bounded_below) text = (above ? "> " : ">= ") + bound_text(low);
  if (bounded_below && bounded_above) text += " and ";
  if (bounded_above) text += (below ? "< " : "<= ") + bound_text(high);
  return text.empty() ? "a number" : text;
}

}  // namespace sdmt::io
