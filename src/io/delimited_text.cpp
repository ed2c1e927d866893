// SPDX-License-Identifier: Apache-2.0
#include "sdmt/io/delimited_text.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <system_error>

namespace sdmt::io {

namespace {

std::string shown(std::string_view cell) {
  constexpr std::size_t kLongest = 40;
  std::string text;
  for (const char c : cell.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
  return "'" + text + (cell.size() > kLongest ? "...'" : "'");
}

std::string shown(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

}  // namespace

std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    throw std::invalid_argument(path.string() + ": is a folder, expected a file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::invalid_argument(path.string() + ": cannot be opened");
  std::string text;
  char block[1 << 16];
  while (file.read(block, sizeof block) || file.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) throw std::invalid_argument(path.string() + ": cannot be read");
  return text;
}

void NumberLine::fail(const std::string& message) const {
  throw std::invalid_argument(path_.string() + ":" + std::to_string(number_) + ": " + message);
}

void NumberLine::refuse(const char* column, double value, const char* expected) const {
  fail(std::string(column) + " is " + shown(value) + ", expected " + expected);
}

std::string_view NumberLine::cell(const char* column) {
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
  const std::string_view text = cell(column);
  // from_chars takes no leading plus, which some writers put.
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) {
    fail(std::string(column) + " is " + shown(text) + ", beyond the range of numbers");
  }
  if (error != std::errc() || end != digits.data() + digits.size()) {
    fail(std::string(column) + " is " + shown(text) + ", expected a number");
  }
  if (!std::isfinite(value)) refuse(column, value, "a finite number");
  return value;
}

int NumberLine::whole(const char* column, int minimum) {
  const double value = number(column);
  if (value != std::floor(value)) refuse(column, value, "a whole number");
  if (value < minimum) refuse(column, value, (">= " + std::to_string(minimum)).c_str());
  if (value > std::numeric_limits<int>::max()) refuse(column, value, "<= 2147483647");
  return static_cast<int>(value);
}

}  // namespace sdmt::io
