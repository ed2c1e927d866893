// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace sdmt::io {

/// The whole of a text file. Throws std::invalid_argument naming it when it cannot be opened or is
/// UTF-16, and std::runtime_error when reading fails.
std::string read_text(const std::filesystem::path& path);

/// One line of numbers separated by commas, with the place it came from for messages.
class NumberLine {
 public:
  NumberLine(const std::filesystem::path& path, std::size_t number, std::string_view text)
      : path_(path), number_(number), rest_(text) {}

  /// The next column as a finite number. Throws std::invalid_argument when it is missing or not
  /// one.
  double number(const char* column);
  /// The next column as a whole number >= minimum.
  int whole(const char* column, int minimum);
  /// The next column as it stands, without blanks around it. Throws when it is missing.
  std::string_view text(const char* column);
  /// Columns not read yet.
  int columns() const;
  /// True when another column follows.
  bool more() const { return !ended_; }

  /// Throws `FILE:LINE: COLUMN is VALUE, expected WHAT`.
  [[noreturn]] void refuse(const char* column, double value, const char* expected) const;

 private:
  [[noreturn]] void fail(const std::string& message) const;

  const std::filesystem::path& path_;
  std::size_t number_;
  std::string_view rest_;
  bool ended_ = false;
};

/// Calls visit(line number, line) for every line of `text` that is not blank, without its line end.
/// A UTF-8 byte order mark, which Windows' editors put first, is passed over.
template <typename Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) {
      line.remove_suffix(1);
    }
    while (!line.empty() && (line.front() == ' ' || line.front() == '\t')) line.remove_prefix(1);
    if (!line.empty()) visit(number, line);
  }
}

}  // namespace sdmt::io
