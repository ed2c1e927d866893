// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "sdmt/nn/tensor.h"
#include "sdmt/train/training_set.h"

namespace sdmt::train {

// FNV-1a, 64 bits: tells one choice of data or weights from another, guards against nothing worse.
inline constexpr std::uint64_t kEmptyHash = TrainingSet::kEmptyFingerprint;

inline void hash_word(std::uint64_t& state, std::uint64_t word) {
  state = (state ^ word) * 0x100000001b3ULL;
}

inline void hash(std::uint64_t& state, std::string_view text) {
  for (const char c : text) hash_word(state, static_cast<unsigned char>(c));
  hash_word(state, 0xFF);  // so that "ab","c" is not "a","bc"
}

inline void hash(std::uint64_t& state, const nn::Tensor& tensor) {
  for (const float value : tensor.values()) hash_word(state, std::bit_cast<std::uint32_t>(value));
}

}  // namespace sdmt::train
