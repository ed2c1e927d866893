// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sdmt::nn {

/// Name of the instruction set that the kernels use on this machine, as Highway spells it:
/// "AVX3_DL" (AVX-512 of Ice Lake and Zen 4), "AVX3", "AVX2", "SSE4", "NEON", "EMU128" (portable)
/// ...
std::string simd_target();

/// Every instruction set that was compiled in and runs on this machine, best first.
std::vector<std::string> simd_targets();

/// Makes the kernels use this instruction set; the empty name goes back to the best. For tests and
/// measurements: layers and networks made before must not be used afterwards, because transformed
/// weights are kept in an order that depends on the instruction set. Throws std::invalid_argument
/// for a name that is not among simd_targets().
void use_simd_target(std::string_view name);

}  // namespace sdmt::nn
