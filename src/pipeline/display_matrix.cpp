// SPDX-License-Identifier: Apache-2.0
#include "display_matrix.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace sdmt::pipeline {

namespace {

// A stretch of the file: the contents of a box.
struct Box {
  std::array<char, 4> type{};
  std::uint64_t begin = 0;
  std::uint64_t end = 0;

  bool is(std::string_view name) const { return std::string_view(type.data(), 4) == name; }
};

class BoxReader {
 public:
  explicit BoxReader(const std::filesystem::path& file)
      : path_(file.string()), file_(file, std::ios::binary) {
    if (!file_) fail("cannot be opened");
    file_.seekg(0, std::ios::end);
    size_ = file_ ? static_cast<std::uint64_t>(file_.tellg()) : 0;
  }

  Box whole_file() const { return {{}, 0, size_}; }

  /// Calls visit(Box) for each box inside `parent` until it returns true.
  template <typename Visit>
  void for_each(const Box& parent, Visit&& visit) {
    std::uint64_t at = parent.begin;
    while (at + 8 <= parent.end) {
      std::uint64_t header = 8;
      std::uint64_t length = number(at, 4);
      if (length == 1) {  // the length is too large for 32 bits and follows the type
        length = number(at + 8, 8);
        header = 16;
      }
      if (length == 0) length = parent.end - at;  // up to the end
      if (!file_ || length < header || length > parent.end - at) return;
      Box box{{}, at + header, at + length};
      read(at + 4, box.type.data(), box.type.size());
      if (visit(box)) return;
      at += length;
    }
  }

  std::optional<Box> child(const Box& parent, std::string_view type) {
    std::optional<Box> found;
    for_each(parent, [&](const Box& box) {
      if (box.is(type)) found = box;
      return found.has_value();
    });
    return found;
  }

  std::uint64_t number(std::uint64_t at, std::size_t size) {
    std::array<unsigned char, 8> bytes{};
    read(at, reinterpret_cast<char*>(bytes.data()), size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | bytes[i];
    return value;
  }

  bool has_text(std::uint64_t at, std::string_view text) {
    std::array<char, 4> bytes{};
    read(at, bytes.data(), bytes.size());
    return std::string_view(bytes.data(), bytes.size()) == text;
  }

 private:
  // A matrix that cannot be read is not one that is not there.
  void read(std::uint64_t at, char* to, std::size_t size) {
    file_.seekg(static_cast<std::streamoff>(at));
    file_.read(to, static_cast<std::streamsize>(size));
    if (file_.bad()) fail("cannot be read");
  }
  [[noreturn]] void fail(const char* what) const {
    throw std::runtime_error(path_ + ": " + what + ": " + std::strerror(errno));
  }

  std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

// The matrix maps (x, y) to (a x + c y, b x + d y), x to the right and y down.
Orientation orientation(int a, int b, int c, int d) {
  const bool mirrored = a * d - b * c < 0;
  if (mirrored) {  // mirroring comes first: x is -x
    a = -a;
    b = -b;
  }
  if (a > 0 && d > 0) return {mirrored, 0};
  if (b > 0 && c < 0) return {mirrored, 1};
  if (a < 0 && d < 0) return {mirrored, 2};
  if (b < 0 && c > 0) return {mirrored, 3};
  return {};
}

}  // namespace

std::optional<Orientation> read_display_matrix(const std::filesystem::path& file) {
  BoxReader reader(file);
  const auto movie = reader.child(reader.whole_file(), "moov");
  if (!movie) return std::nullopt;
  Orientation found;
  reader.for_each(*movie, [&](const Box& track) {
    if (!track.is("trak")) return false;
    const auto header = reader.child(track, "tkhd");
    const auto media = reader.child(track, "mdia");
    const auto handler = media ? reader.child(*media, "hdlr") : std::nullopt;
    if (!header || !handler || !reader.has_text(handler->begin + 8, "vide")) return false;
    // Times and durations take 32 bits in version 0, 64 bits in version 1.
    const std::uint64_t matrix = header->begin + (reader.number(header->begin, 1) == 1 ? 52 : 40);
    const auto sign = [&](int index) {  // of a number in 16.16 bits
      const auto value = static_cast<std::int32_t>(
          static_cast<std::uint32_t>(reader.number(matrix + 4 * static_cast<unsigned>(index), 4)));
      return (value > 0) - (value < 0);
    };
    found = orientation(sign(0), sign(1), sign(3), sign(4));
    return true;
  });
  return found;
}

}  // namespace sdmt::pipeline
