// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sdmt/io/safetensors.h"

namespace sdmt::io {

/// What the header of a safetensors file says.
struct SafetensorsHeader {
  std::map<std::string, std::string> metadata;
  std::vector<SafetensorsEntry> tensors;  ///< by offset, which counts from the data's first byte
};

/// Throws std::invalid_argument, beginning with `file`, for anything wrong with the header `text`
/// of a file with `data_bytes` bytes behind it.
SafetensorsHeader parse_safetensors_header(std::string_view text, std::uint64_t data_bytes,
                                           const std::string& file);

}  // namespace sdmt::io
