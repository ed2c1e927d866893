// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace sdmt::nn {

/// Uses of scratch memory that may be alive at the same time in one thread.
enum class ScratchUse { packed_a, packed_b, columns, accumulators, padded, band, shards };

/// At least `count` floats at a 64-byte boundary that belong to the calling thread and this use
/// until the thread asks for the same use again. The memory is kept, so that steady work allocates
/// nothing; its content is unspecified.
float* thread_scratch(ScratchUse use, std::size_t count);

}  // namespace sdmt::nn
