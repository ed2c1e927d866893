// SPDX-License-Identifier: Apache-2.0
#include "image_truncation.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace sdmt::media {

namespace {

using Bytes = std::span<const std::uint8_t>;

bool has_text(Bytes bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

// A number of `size` bytes; bytes beyond the end count as 0.
std::uint64_t number(Bytes bytes, std::size_t at, int size, bool big_endian) {
  std::uint64_t value = 0;
  for (int i = 0; i < size; ++i) {
    const std::size_t from = at + static_cast<std::size_t>(big_endian ? i : size - 1 - i);
    value = value << 8 | (from < bytes.size() ? bytes[from] : 0);
  }
  return value;
}

// ITU-T T.81, annex B: segments with a length, and after each start of scan coded data, in which
// FF is followed by 00 or a restart marker.
bool is_truncated_jpeg(Bytes bytes) {
  constexpr int kStartOfImage = 0xD8;
  constexpr int kEndOfImage = 0xD9;
  constexpr int kStartOfScan = 0xDA;
  const auto is_alone = [](int marker) {  // restart, start of image, TEM: no segment follows
    return (marker >= 0xD0 && marker <= kStartOfImage) || marker == 0x01;
  };
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    if (bytes[at] != 0xFF) {  // not between segments: garbage, which decoders pass over
      ++at;
      continue;
    }
    const int marker = bytes[at + 1];
    if (marker == 0xFF) {  // a fill byte
      ++at;
      continue;
    }
    at += 2;
    if (marker == kEndOfImage) return false;
    if (marker == 0 || is_alone(marker)) continue;
    if (at + 2 > bytes.size()) return true;
    at += number(bytes, at, 2, true);
    if (marker != kStartOfScan) continue;
    while (at + 1 < bytes.size() &&
           (bytes[at] != 0xFF || bytes[at + 1] == 0 || is_alone(bytes[at + 1]))) {
      ++at;
    }
  }
  return true;
}

std::uint32_t crc32(Bytes bytes) {
  static const auto kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      std::uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = value & 1 ? 0xEDB88320U ^ value >> 1 : value >> 1;
      table[i] = value;
    }
    return table;
  }();
  std::uint32_t crc = ~0U;
  for (const std::uint8_t byte : bytes) crc = kTable[(crc ^ byte) & 0xFF] ^ crc >> 8;
  return ~crc;
}

// PNG specification, section 5: chunks of length, type, data and checksum.
bool is_truncated_png(Bytes bytes) {
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const auto length = static_cast<std::size_t>(number(bytes, at, 4, true));
    if (length > bytes.size() - at - 12) return true;
    if (crc32(bytes.subspan(at + 4, length + 4)) != number(bytes, at + 8 + length, 4, true)) {
      return true;
    }
    if (has_text(bytes, at + 4, "IEND")) return false;
    at += length + 12;
  }
  return true;
}

// TIFF 6.0, section 2: a directory of entries of 12 bytes; where and how long the strips (tags 273,
// 279) or tiles (324, 325) are.
bool is_truncated_tiff(Bytes bytes) {
  const bool big_endian = bytes[0] == 'M';
  const auto directory = static_cast<std::size_t>(number(bytes, 4, 4, big_endian));
  if (directory + 2 > bytes.size()) return true;
  const auto entries = static_cast<std::size_t>(number(bytes, directory, 2, big_endian));
  if (entries * 12 > bytes.size() - directory - 2) return true;

  struct Values {
    std::size_t at = 0;
    std::size_t count = 0;
    int size = 4;
  };
  Values offsets;
  Values lengths;
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    const auto tag = number(bytes, entry, 2, big_endian);
    if (tag != 273 && tag != 279 && tag != 324 && tag != 325) continue;
    constexpr int kShort = 3;
    Values values{entry + 8, static_cast<std::size_t>(number(bytes, entry + 4, 4, big_endian)),
                  number(bytes, entry + 2, 2, big_endian) == kShort ? 2 : 4};
    const std::size_t all = values.count * static_cast<std::size_t>(values.size);
    if (all > 4) values.at = static_cast<std::size_t>(number(bytes, entry + 8, 4, big_endian));
    if (values.at > bytes.size() || all > bytes.size() - values.at) return true;
    (tag == 273 || tag == 324 ? offsets : lengths) = values;
  }
  const auto value = [&](const Values& values, std::size_t i) {
    return number(bytes, values.at + i * static_cast<std::size_t>(values.size), values.size,
                  big_endian);
  };
  for (std::size_t i = 0; i < std::min(offsets.count, lengths.count); ++i) {
    if (value(offsets, i) + value(lengths, i) > bytes.size()) return true;
  }
  return false;
}

}  // namespace

bool is_truncated_image(Bytes bytes) {
  if (has_text(bytes, 0, "\xFF\xD8")) return is_truncated_jpeg(bytes);
  if (has_text(bytes, 0, "\x89PNG\r\n\x1A\n")) return is_truncated_png(bytes);
  if (has_text(bytes, 0, std::string_view("II*\0", 4)) ||
      has_text(bytes, 0, std::string_view("MM\0*", 4))) {
    return is_truncated_tiff(bytes);
  }
  if (has_text(bytes, 0, "RIFF") && has_text(bytes, 8, "WEBP")) {
    return number(bytes, 4, 4, false) + 8 > bytes.size();
  }
  return false;
}

}  // namespace sdmt::media
