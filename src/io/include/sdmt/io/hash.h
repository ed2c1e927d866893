// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace sdmt::io {

// FNV-1a, 64 bits: tells one choice of data from another and what happened to a file, guards
// against nothing worse.
inline constexpr std::uint64_t kEmptyHash = 0xcbf29ce484222325;

inline void hash_word(std::uint64_t& state, std::uint64_t word) {
  state = (state ^ word) * 0x100000001b3;
}

inline void hash(std::uint64_t& state, std::string_view text) {
  for (const char c : text) hash_word(state, static_cast<unsigned char>(c));
  hash_word(state, 0xFF);  // so that "ab","c" is not "a","bc"
}

}  // namespace sdmt::io
