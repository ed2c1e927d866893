// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/checked_value.h"

#include <stdexcept>

namespace sdmt::io {

std::string printable(std::string_view text, std::size_t longest, std::string_view keep) {
  const bool cut = text.size() > longest;
  if (cut) {
    // Not within a character of several bytes: its tail begins with the bits 10.
    while (longest > 0 && (text[longest] & 0xC0) == 0x80) --longest;
    text = text.substr(0, longest);
  }
  std::string line;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    // U+0080 to U+009F, a terminal's other control characters, are C2 80 to C2 9F in UTF-8.
    const bool c1 = byte == 0xC2 && i + 1 < text.size() && (text[i + 1] & 0xE0) == 0x80;
    if (c1) ++i;
    const bool control = byte < 0x20 || byte == 0x7F || c1;
    line += control && keep.find(text[i]) == std::string_view::npos ? '?' : text[i];
  }
  return cut ? line + "..." : line;
}

std::string quoted(std::string_view text) { return "'" + printable(text, 100) + "'"; }

void refuse_value(std::string_view field, std::string_view value, std::string_view expected) {
  throw std::invalid_argument(
      std::string(field).append(" is ").append(value).append(", expected ").append(expected));
}

}  // namespace sdmt::io
