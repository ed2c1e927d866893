// SPDX-License-Identifier: Apache-2.0
#include "sdmt/train/configuration.h"

#include <array>
#include <charconv>
#include <stdexcept>

namespace sdmt::train {

void require_same_configuration(const std::string& file, const Configuration& stored,
                                const Configuration& present) {
  for (const auto& [key, value] : present) {
    const auto found = stored.find(key);
    const std::string was = found == stored.end() ? "nothing" : found->second;
    if (was == value) continue;
    std::string message = file;
    message.append(": made with ").append(key).append(" = ").append(was);
    throw std::invalid_argument(message.append(", this run has ").append(value));
  }
}

std::string to_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

}  // namespace sdmt::train
