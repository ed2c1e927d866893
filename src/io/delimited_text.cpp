// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/delimited_text.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <system_error>

#include "sdmt/io/checked_value.h"
#include "sdmt/io/retry.h"

namespace sdmt::io {

namespace {

// A cell as messages show it; files that are no text at all make few letters.
std::string shown(std::string_view cell) {
  constexpr std::size_t kLongest = 40;
  std::string text;
  for (const char c : cell.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
  return "'" + text + (cell.size() > kLongest ? "...'" : "'");
}

// What a line of numbers that has no commas, or others in place of them, needs to be told.
std::string_view separator_hint(std::string_view cell) {
  return cell.find_first_of(";\t ") == std::string_view::npos
             ? ""
             : " (columns are separated by commas, decimals by a point)";
}

}  // namespace

std::string read_text(const std::filesystem::path& path) {
  const auto fail = [&](const char* what) {
    return path.string() + ": " + what + ": " + std::strerror(errno);
  };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw std::invalid_argument(path.string() + ": is a folder, expected a file");
  }
  const int descriptor = retry([&] { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); });
  if (descriptor < 0) throw std::invalid_argument(fail("cannot be opened"));
  std::string text;
  std::array<char, 1 << 16> block;
  ssize_t got = 0;
  try {
    while ((got = retry([&] { return ::read(descriptor, block.data(), block.size()); })) > 0) {
      text.append(block.data(), got);
    }
  } catch (...) {
    ::close(descriptor);
    throw;
  }
  const int cause = errno;
  ::close(descriptor);
  errno = cause;
  if (got < 0) throw std::runtime_error(fail("cannot be read"));
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw std::invalid_argument(path.string() +
                                ": is UTF-16 text, expected UTF-8 or ASCII (as PowerShell's "
                                "Out-File -Encoding ascii writes)");
  }
  return text;
}

int NumberLine::columns() const {
  return ended_ ? 0 : 1 + static_cast<int>(std::count(rest_.begin(), rest_.end(), ','));
}

void NumberLine::fail(const std::string& message) const {
  throw std::invalid_argument(path_.string() + ":" + std::to_string(number_) + ": " + message);
}

void NumberLine::refuse(const char* column, double value, const char* expected) const {
  fail(std::string(column) + " is " + number_text(value) + ", expected " + expected);
}

std::string_view NumberLine::text(const char* column) {
  if (ended_) fail(std::string(column) + " is missing");
  const std::size_t comma = rest_.find(',');
  std::string_view cell = rest_.substr(0, comma);
  ended_ = comma == std::string_view::npos;
  rest_.remove_prefix(ended_ ? rest_.size() : comma + 1);
  while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
  while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
  return cell;
}

double NumberLine::number(const char* column) {
  const std::string_view text = this->text(column);
  // from_chars takes no leading plus, which some writers put.
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) {
    fail(std::string(column) + " is " + shown(text) + ", beyond the range of numbers");
  }
  if (error != std::errc() || end != digits.data() + digits.size()) {
    fail(std::string(column) + " is " + shown(text) + ", expected a number" +
         std::string(separator_hint(text)));
  }
  if (!std::isfinite(value)) refuse(column, value, "a finite number");
  return value;
}

int NumberLine::whole(const char* column, int minimum) {
  const double value = number(column);
  if (value != std::floor(value)) refuse(column, value, "a whole number");
  if (value < minimum) refuse(column, value, (">= " + number_text(minimum)).c_str());
  if (value > std::numeric_limits<int>::max()) refuse(column, value, "<= 2147483647");
  return static_cast<int>(value);
}

}  // namespace sdmt::io
