// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace sdmt::io {

/// The shortest text that reads back as the same number: "0.1", "1e+06", "inf", "-3".
template <typename Number>
std::string number_text(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// `text` as a number; nothing when it is anything else, has something behind it, or does not fit.
template <typename Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data(), end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

/// Text of a stranger, fit for one line of a terminal: control characters, but for those in `keep`,
/// become '?', and all but the first `longest` bytes "...".
std::string printable(std::string_view text, std::size_t longest = 4000,
                      std::string_view keep = {});
/// printable() between single quotes, at most 100 bytes of it.
std::string quoted(std::string_view text);

/// Throws std::invalid_argument `FIELD is VALUE, expected EXPECTED`; VALUE as it is to be shown.
[[noreturn]] void refuse_value(std::string_view field, std::string_view value,
                               std::string_view expected);

/// Refuses `value`, as `FIELD is VALUE, expected EXPECTED`, unless it `holds`.
template <typename Number>
void require(bool holds, std::string_view field, Number value, std::string_view expected) {
  if (!holds) refuse_value(field, number_text(value), expected);
}

/// Refuses a value outside low..high, and NaN.
template <typename Number>
void require_in(std::string_view field, Number value, std::type_identity_t<Number> low,
                std::type_identity_t<Number> high) {
  if (value >= low && value <= high) return;
  refuse_value(field, number_text(value), number_text(low) + ".." + number_text(high));
}

}  // namespace sdmt::io
