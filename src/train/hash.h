// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "sdmt/io/hash.h"
#include "sdmt/nn/tensor.h"

namespace sdmt::train {

using io::hash, io::kEmptyHash;

inline void hash(std::uint64_t& state, const nn::Tensor& tensor) {
  for (const float value : tensor.values())
    io::hash_word(state, std::bit_cast<std::uint32_t>(value));
}

}  // namespace sdmt::train
