// SPDX-License-Identifier: Apache-2.0
#include "cli/frame_range.h"

#include <optional>
#include <stdexcept>

#include "sdmt/io/checked_value.h"

namespace sdmt::tools {

FrameRange parse_frame_range(const std::string& text) {
  FrameRange range;
  const auto dash = text.find('-');
  const auto read = [](const std::string& number, int& frame) {
    if (number.empty()) return true;
    const std::optional<int> value = io::parse_number<int>(number);
    if (value) frame = *value;
    return value.has_value();
  };
  if (dash == std::string::npos || text.size() == 1 || !read(text.substr(0, dash), range.first) ||
      !read(text.substr(dash + 1), range.last) || range.first < 1 || range.last < range.first) {
    throw std::invalid_argument("--frames is " + io::quoted(text) +
                                ", expected A-B, A- or -B, counted from 1");
  }
  return range;
}

void add_frame_range(CLI::App& command, FrameRange& range, const std::string& help) {
  command
      .add_option_function<std::string>(
          "--frames", [&range](const std::string& text) { range = parse_frame_range(text); }, help)
      ->type_name("A-B");
}

}  // namespace sdmt::tools
