// SPDX-License-Identifier: Apache-2.0
#include "cli/run_record.h"

#include <fmt/core.h>

#include <cctype>
#include <cstdlib>
#include <ctime>
#include <string_view>

#include "sdmt/io/checked_value.h"
#include "sdmt/pipeline/frame_source.h"

namespace sdmt::tools {

namespace {

std::string recorded = "sdmt";

std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain = "-_./=:,+@%";
  bool plain = !word.empty();
  std::string quoted = "'";
  for (const char c : word) {
    const auto byte = static_cast<unsigned char>(c);
    plain = plain && (std::isalnum(byte) != 0 || kPlain.find(c) != std::string_view::npos);
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return plain ? word : quoted + "'";
}

}  // namespace

void record_command_line(std::span<const std::string> arguments) {
  for (const std::string& word : arguments) {
    recorded += " " + shell_word(pipeline::display_name(word));
  }
}

const std::string& command_line() { return recorded; }

std::string date_of_run() {
  std::time_t seconds = std::time(nullptr);
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH"); epoch != nullptr) {
    seconds = io::parse_number<std::time_t>(epoch).value_or(seconds);
  }
  std::tm date{};
  if (::gmtime_r(&seconds, &date) == nullptr) return "unknown";
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02} UTC", date.tm_year + 1900, date.tm_mon + 1,
                     date.tm_mday, date.tm_hour, date.tm_min);
}

}  // namespace sdmt::tools
