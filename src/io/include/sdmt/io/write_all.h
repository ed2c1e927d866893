// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

namespace sdmt::io {

/// Writes the bytes to a descriptor, however many calls that takes and signals interrupt. Returns
/// how many it took: fewer than all where one failed, with errno.
std::size_t write_all(int descriptor, std::string_view bytes);

}  // namespace sdmt::io
