// SPDX-License-Identifier: Apache-2.0
#include "container_end.h"

#include <array>
#include <cstdint>
#include <fstream>
#include <string_view>

namespace sdmt::pipeline {

namespace {

using Header = std::array<unsigned char, 16>;

std::uint64_t big_endian(const Header& header, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) value = value << 8 | header[at + i];
  return value;
}

bool has_text(const Header& header, std::size_t at, std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (header[at + i] != static_cast<unsigned char>(text[i])) return false;
  }
  return true;
}

// A RIFF chunk: type, then the length of what follows, the lowest byte first; padded to even.
std::uint64_t riff_length(const Header& header) {
  const std::uint64_t length =
      header[4] | header[5] << 8 | header[6] << 16 | static_cast<std::uint64_t>(header[7]) << 24;
  return length == 0 ? 0 : 8 + length + length % 2;
}

// A box of ISO/IEC 14496-12: length with header, type; 1 stands for a length of 64 bits behind.
std::uint64_t box_length(const Header& header) {
  const auto length = big_endian(header, 0, 4);
  return length == 1 ? big_endian(header, 8, 8) : length;
}

// An element of EBML (RFC 8794) whose identifier has 4 bytes: the zeros in front of the first one
// say how many bytes the length has; all ones are no length.
std::uint64_t ebml_length(const Header& header) {
  std::size_t size = 1;
  while (size <= 8 && (header[4] & (0x80U >> (size - 1))) == 0) ++size;
  if (size > 8) return 0;
  const std::uint64_t ones = (std::uint64_t{1} << (7 * size)) - 1;
  const std::uint64_t length = big_endian(header, 4, size) & ones;
  return length == ones ? 0 : 4 + size + length;
}

}  // namespace

bool ends_with_its_container(const std::filesystem::path& video) {
  std::ifstream file(video, std::ios::binary);
  file.seekg(0, std::ios::end);
  if (!file) return false;
  const auto end = static_cast<std::uint64_t>(file.tellg());
  std::uint64_t at = 0;
  bool riff = false;
  bool ebml = false;
  while (at < end) {
    Header header{};
    file.clear();  // the last header may be shorter than what is read
    file.seekg(static_cast<std::streamoff>(at));
    file.read(reinterpret_cast<char*>(header.data()), header.size());
    if (at == 0) {
      riff = has_text(header, 0, "RIFF");
      ebml = has_text(header, 0, "\x1A\x45\xDF\xA3");
    }
    const auto length = riff   ? riff_length(header)
                        : ebml ? ebml_length(header)
                               : box_length(header);
    if (length < 8 || length > end - at) return false;
    at += length;
  }
  return end > 0;
}

}  // namespace sdmt::pipeline
